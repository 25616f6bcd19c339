#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Resolve requirements/*.in into requirements/lock.txt: every version, for Python 3.10 to 3.14.
# Needs `uv` (pip install uv). Only for those who change the requirements; setting up needs no uv.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../requirements"

if ! command -v uv > /dev/null; then
    echo "lock: uv is missing: pip install uv" >&2
    exit 1
fi

{
    echo "# Written by \`make lock\` from the .in files beside it. Python 3.10 to 3.14, Linux, x86-64."
    # The markers of the one platform there is are left out: they would hide the ones that differ.
    uv pip compile --quiet --universal --python-version 3.10 --no-header \
        --annotation-style line --no-annotate ./*.in |
        sed -E "s/ and implementation_name == 'cpython'//
                s/ and platform_machine == 'x86_64'//
                s/ and sys_platform == 'linux'//
                s/ and python_full_version < '3\.15'//
                s/ ; python_full_version < '3\.15'$//"
} > lock.new
mv lock.new lock.txt
