#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Run every static check; fails after all of them have run.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

failed=0
check() {
    echo "lint: $*"
    "$@" || failed=1
}

check ruff check --quiet --output-format concise .
check ruff format --check --output-format concise .
check python scripts/make_message_stubs.py
check mypy
check lint-imports --no-logo --no-cache
check python scripts/check_licence_headers.py
check python scripts/check_sizes.py
check pytest -q -m linter ros2_ws/src/*/test/test_linters.py
exit $failed
