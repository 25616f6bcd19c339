#!/bin/bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Puts ROS and the workspace on the path, then becomes the command.
set -eo pipefail
if [ -f /opt/ros/jazzy/setup.bash ]; then
    source /opt/ros/jazzy/setup.bash
fi
source "$(dirname "${BASH_SOURCE[0]}")/../env.bash"
exec "$@"
