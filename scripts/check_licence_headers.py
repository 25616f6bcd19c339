# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Check that every source file of the project starts with the copyright and licence lines."""

import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
SELF = pathlib.Path(__file__).resolve()
HEADER = SELF.read_text(encoding="utf-8").partition("\n\n")[0]


def main() -> int:
    """Name each tracked or new Python file without the header; return the exit code."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", "*.py"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\0")
    sources = {name: ROOT / name for name in listed if name and (ROOT / name).exists()}
    bare = [
        name
        for name, path in sources.items()
        if path.stat().st_size and not path.read_text(encoding="utf-8").startswith(HEADER)
    ]
    for name in bare:
        print(f"{name}: no licence header: begin it like scripts/{SELF.name}")
    return bool(bare)


if __name__ == "__main__":
    sys.exit(main())
