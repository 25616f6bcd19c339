# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Sourced by bash, from any directory: puts `entrain`, the nodes, rclpy and the messages on the
# path.
#
#   source env.bash

if [ -z "${BASH_VERSION:-}" ]; then
    echo "env: this is for bash: start bash, then source env.bash" >&2
    return 1
fi

_gait_entrainment_source() {
    local root package
    root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" > /dev/null && pwd -P) || return 1
    source "$root/scripts/underlay.bash" || return 1
    if [ ! -f "$root/ros2_ws/install/complete" ]; then
        echo "env: $root is not built yet: run 'make build' there" >&2
        return 1
    fi

    # colcon's own set-up of the workspace reads variables that may be unset.
    local nounset=${-//[!u]/}
    set +u
    source "$root/ros2_ws/install/local_setup.bash"
    [ -z "$nounset" ] || set -u
    _gait_entrainment_prepend PATH "$root/ros2_ws/install/gait_entrainment_drivers/bin"
    _gait_entrainment_prepend PATH "$root/ros2_ws/install/gait_entrainment_commands/bin"
    for package in gait_entrainment_page gait_entrainment_nodes; do
        _gait_entrainment_prepend PATH "$root/ros2_ws/install/$package/lib/$package"
    done

    # Nobody else on the network hears a run, and the other way round, unless the user says so.
    export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
    export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
    # Shared memory that takes a stride of samples at once: the file says what that gains.
    export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$root/ros2_ws/install/gait_entrainment_nodes/share/gait_entrainment_nodes/config/fastdds.xml}
    # What that file needs: Fast DDS's own values, from which our processes depart.
    export GAIT_ENTRAINMENT_PORT_BASE=7400 GAIT_ENTRAINMENT_PORT_SHIFT=0
}

_gait_entrainment_source
_gait_entrainment_status=$?
unset -f _gait_entrainment_source _gait_entrainment_prepend
# The status outlives the variable that holds it.
eval "unset _gait_entrainment_status; return $_gait_entrainment_status"
