#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Build the workspace with colcon if something that needs building has changed.
#
# Python modules are linked, not copied, so editing one needs no build; a changed message, launch
# file, entry point or package.xml does.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fingerprint=$({
    cat .venv/complete scripts/build.sh
    find ros2_ws/src ros2_ws/wheels -type f \( -not -name '*.py' -o -name setup.py \) -not -name '*.pyc' \
        -not -path '*/__pycache__/*' -not -path '*/.*' -not -path '*.egg-info/*' -print0 |
        sort -z | xargs -0 sha256sum
} | sha256sum)

if [ "$(cat ros2_ws/install/complete 2> /dev/null)" != "$fingerprint" ]; then
    echo "build: colcon builds the packages ..."
    start=$SECONDS
    # A build made by another environment refers to that environment's Python.
    if [ "$(cat ros2_ws/build/environment 2> /dev/null)" != "$(cat .venv/complete)" ]; then
        rm -rf ros2_ws/build ros2_ws/install ros2_ws/log
    fi
    rm -f ros2_ws/install/complete
    (
        # A shell that has sourced env.bash has the last build on its paths: build without it.
        for variable in AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONPATH LD_LIBRARY_PATH; do
            value=$(tr : '\n' <<< "${!variable:-}" | sed "\|^$PWD/|d" | paste -sd :)
            if [ -n "$value" ]; then export "$variable=$value"; else unset "$variable"; fi
        done
        unset COLCON_PREFIX_PATH
        root=$PWD
        source scripts/underlay.bash
        cd ros2_ws
        # Packages that a full ROS 2 has but its wheels lack.
        base_paths=(src)
        if [ "$(< ../.venv/ros)" = wheels ]; then base_paths+=(wheels); fi
        colcon --log-level error --log-base log build --base-paths "${base_paths[@]}" --symlink-install --event-handlers console_direct- \
            --cmake-args -DPython3_EXECUTABLE="$(command -v python)" \
            -DPython3_FIND_VIRTUALENV=ONLY -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF --no-warn-unused-cli
    )
    cp .venv/complete ros2_ws/build/environment
    echo "$fingerprint" > ros2_ws/install/complete
    echo "build: done in $((SECONDS - start)) s"
fi

# The walker is compiled and cached at its first use: do that now.
walker=$({
    cat .venv/complete
    cd ros2_ws/src
    find gait_entrainment/gait_entrainment/{geometry.py,walker} \
        gait_entrainment_studies/gait_entrainment_studies/walks.py -name '*.py' -print0 |
        sort -z | xargs -0 cat
} | sha256sum)
if [ "$(cat ros2_ws/install/compiled 2> /dev/null)" != "$walker" ]; then
    echo "build: compiling the walker ..."
    start=$SECONDS
    source ./env.bash
    if python scripts/compile_walker.py > /dev/null; then
        echo "$walker" > ros2_ws/install/compiled
        echo "build: done in $((SECONDS - start)) s"
    else
        echo "build: the walker will be compiled at its first use instead" >&2
    fi
fi
