#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Run every test, in three parts. Most tests share the processors, one file per processor and one
# extra, because some tests wait. Real-time tests follow, one per processor; as they mostly wait,
# tests that only compute use the time that is left. Tests that stop every robot on this machine or
# check its timing run alone. Files with few, long tests come first, so that no processor waits for
# them at the end. The slowest tests are listed. Arguments are passed to pytest.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

nothing_selected=5
failed=0
run() {
    echo "test: pytest $*"
    pytest --durations=15 "$@" || [[ $? == "$nothing_selected" ]] || failed=1
}

processors=$(nproc)
source=ros2_ws/src
devices=$source/gait_entrainment_drivers/test
alone=("$devices/test_torque_loop.py" tests/safety tests/page
    tests/system/test_{preflight,session_stop,stop_command}.py)
waiting=("$devices"
    tests/system/test_{deaths,drivers,interventions,person,perturbator,races,real_time_run}.py
    tests/system/test_{ros2_control,spectators,stopping}.py)
computing=("$source/gait_entrainment/test" "$source/gait_entrainment_studies/test")
shared=(--dist loadfile --no-loadscope-reorder "${alone[@]/#/--ignore=}")

run --numprocesses $((processors + 1)) "${shared[@]}" "${waiting[@]/#/--ignore=}" \
    "${computing[@]/#/--ignore=}" tests "$source" "$@"

computed=$(mktemp)
set -m # without it, a job in the background ignores SIGINT, and so does all that it starts
{
    renice -n 19 "$BASHPID" > /dev/null
    run "${computing[@]}" "$@"
    exit $failed
} > "$computed" 2>&1 &
background=$!
set +m
trap 'kill -- -"$background" 2> /dev/null; exit 130' INT
run --numprocesses "$processors" "${shared[@]}" "${waiting[@]}" "$@"
wait "$background" || failed=1
cat "$computed"
rm "$computed"

run "${alone[@]}" "$@"
exit $failed
