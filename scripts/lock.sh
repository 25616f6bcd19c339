#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Resolve requirements/*.in into requirements/lock.txt: every version, for Python 3.10 to 3.14.
# Only needed when the requirements change. Uses what setup.sh has installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../requirements"

if [ ! -x ../.venv/bin/uv ]; then
    echo "lock: there is no .venv: make setup" >&2
    exit 1
fi

{
    echo "# Written by \`make lock\` from the .in files beside it. Python 3.10 to 3.14, Linux, x86-64."
    # Markers of the only supported platform are omitted: they would hide those that matter.
    ../.venv/bin/uv pip compile --quiet --universal --python-version 3.10 --no-header \
        --annotation-style line --no-annotate ./*.in |
        sed -E "s/ and implementation_name == 'cpython'//
                s/ and platform_machine == 'x86_64'//
                s/ and sys_platform == 'linux'//
                s/ and python_full_version < '3\.15'//
                s/ ; python_full_version < '3\.15'$//"
} > lock.new
mv lock.new lock.txt
