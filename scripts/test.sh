#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Every test. Most of the packages' share the processors. Those of ankle robots, which run in real
# time, and of the whole system, five processes each, have them alone. Arguments go to pytest both
# times.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

nothing_selected=5
failed=0
run() {
    echo "test: pytest $*"
    pytest "$@" || [[ $? == "$nothing_selected" ]] || failed=1
}

devices=ros2_ws/src/gait_entrainment_drivers/test
run --numprocesses auto --ignore "$devices" ros2_ws/src "$@"
run "$devices" tests "$@"
exit $failed
