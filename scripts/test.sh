#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Every test. Most share the processors, a file at a time. Those that hold real time to account, or
# stop every robot of this machine, have it to themselves. Arguments go to pytest both times.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

nothing_selected=5
failed=0
run() {
    echo "test: pytest $*"
    pytest "$@" || [[ $? == "$nothing_selected" ]] || failed=1
}

system=(deaths drivers interventions perturbator preflight real_time_run ros2_control spectators stopping)
alone=(ros2_ws/src/gait_entrainment_drivers/test tests/safety)
for name in "${system[@]}"; do alone+=("tests/system/test_$name.py"); done
run --numprocesses auto --dist loadfile "${alone[@]/#/--ignore=}" ros2_ws/src tests "$@"
run "${alone[@]}" "$@"
exit $failed
