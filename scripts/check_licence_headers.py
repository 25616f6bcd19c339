# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Check that every program of the project begins with the copyright and licence lines."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEADER = Path(__file__).read_text(encoding="utf-8").partition("\n\n")[0] + "\n"
# Python, including launch files; shell; CMake, make and Docker.
PROGRAMS = (
    "*.py",
    "*.sh",
    "*.bash",
    "CMakeLists.txt",
    "*.cmake",
    "Makefile",
    "Dockerfile",
    ".ci/*",
    "*/scripts/entrain",
)
# Lines that have their meaning only as the first line of a file.
FIRST_LINES = ("#!", "# syntax=")


def has_header(path: Path) -> bool:
    """Return whether a file begins with the header or is empty."""
    text = path.read_text(encoding="utf-8")
    if text.startswith(FIRST_LINES):
        text = text.partition("\n")[2]
    return not text or text.startswith(HEADER)


def main() -> int:
    """Print each tracked or new program without the header; return the exit code."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", "--"]
        + [f":(glob)**/{pattern}" for pattern in PROGRAMS],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\0")
    bare = [
        name for name in listed if name and (ROOT / name).exists() and not has_header(ROOT / name)
    ]
    for name in bare:
        print(f"{name}: no licence header: begin it like scripts/{Path(__file__).name}")
    return bool(bare)


if __name__ == "__main__":
    sys.exit(main())
