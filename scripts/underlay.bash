# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Sourced by env.bash and by the scripts, with `root` set: puts .venv, and with it ROS 2, on the
# path. Where a full ROS 2 is sourced, .venv only adds to it.

# Put a directory at the head of a list of directories, once.
_gait_entrainment_prepend() {
    local list=":${!1-}:"
    list=${list//":$2:"/:}
    list=${list#:}
    list=${list%:}
    printf -v "$1" '%s' "$2${list:+:$list}"
    export "${1?}"
}

if [ ! -f "$root/.venv/complete" ]; then
    echo "env: $root is not set up yet: run 'make build' there" >&2
    return 1
elif [ "$(< "$root/.venv/ros")" = sourced ] && [ "${ROS_DISTRO:-}" != jazzy ]; then
    echo "env: $root was set up on a sourced ROS 2 Jazzy: source its setup.bash first, or run 'make build' again" >&2
    return 1
elif [ "$(< "$root/.venv/ros")" = wheels ] && [ -n "${ROS_DISTRO:-}" ]; then
    echo "env: $root was set up with a ROS 2 of its own, but ROS 2 $ROS_DISTRO is sourced: run 'make build' again, or use a shell without ROS" >&2
    return 1
fi

_gait_entrainment_prepend PATH "$root/.venv/bin"
if [ "$(< "$root/.venv/ros")" = wheels ]; then
    _gait_entrainment_prepend AMENT_PREFIX_PATH "$root/.venv"
    _gait_entrainment_prepend CMAKE_PREFIX_PATH "$root/.venv"
    # Without the next lines the wheels set the library path themselves, by starting every Python
    # process a second time.
    for _gait_entrainment_directory in "$root"/.venv/lib/python3.*/site-packages/ros_*.libs "$root/.venv/lib"; do
        _gait_entrainment_prepend LD_LIBRARY_PATH "$_gait_entrainment_directory"
    done
    unset _gait_entrainment_directory
    export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
fi
