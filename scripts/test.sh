#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Every test. Most share the processors, a file for each at a time; then so do those that run in
# real time with some patience. Those that hold real time to account, or stop every robot of this
# machine, have it to themselves. Arguments go to pytest each time.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

nothing_selected=5
failed=0
run() {
    echo "test: pytest $*"
    pytest "$@" || [[ $? == "$nothing_selected" ]] || failed=1
}

devices=ros2_ws/src/gait_entrainment_drivers/test
patient=("$devices" tests/system/test_{interventions,perturbator,ros2_control}.py)
alone=("$devices/test_torque_loop.py" tests/safety
    tests/system/test_{deaths,drivers,preflight,real_time_run,spectators,stopping}.py)
side_by_side=(--numprocesses auto --dist loadfile)
run "${side_by_side[@]}" "${patient[@]/#/--ignore=}" "${alone[@]/#/--ignore=}" ros2_ws/src tests "$@"
run "${side_by_side[@]}" "${alone[@]/#/--ignore=}" "${patient[@]}" "$@"
run "${alone[@]}" "$@"
exit $failed
