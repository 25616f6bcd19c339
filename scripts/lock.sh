#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Resolve requirements/*.in into requirements/lock.txt: every version, for Python 3.10 to 3.14.
# Only for those who change the requirements. Needs what setting up has installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../requirements"

if [ ! -x ../.venv/bin/uv ]; then
    echo "lock: there is no .venv: make setup" >&2
    exit 1
fi

{
    echo "# Written by \`make lock\` from the .in files beside it. Python 3.10 to 3.14, Linux, x86-64."
    # The markers of the one platform there is are left out: they would hide the ones that differ.
    ../.venv/bin/uv pip compile --quiet --universal --python-version 3.10 --no-header \
        --annotation-style line --no-annotate ./*.in |
        sed -E "s/ and implementation_name == 'cpython'//
                s/ and platform_machine == 'x86_64'//
                s/ and sys_platform == 'linux'//
                s/ and python_full_version < '3\.15'//
                s/ ; python_full_version < '3\.15'$//"
} > lock.new
mv lock.new lock.txt
