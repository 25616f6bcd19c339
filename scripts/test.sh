#!/usr/bin/env bash
# Every test. Those of the packages share the processors; those of the whole system start five
# processes each and have them alone. Arguments go to pytest both times.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

nothing_selected=5
failed=0
run() {
    echo "test: pytest $*"
    pytest "$@" || [[ $? == "$nothing_selected" ]] || failed=1
}

run --numprocesses auto ros2_ws/src "$@"
run tests "$@"
exit $failed
