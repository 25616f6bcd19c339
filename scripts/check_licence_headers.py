# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Check that every source file of the project starts with the copyright and licence lines."""

import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
HEADER = "".join(pathlib.Path(__file__).read_text(encoding="utf-8").partition("\n\n")[:1])


def main() -> int:
    """Name each tracked or new Python file without the header; return the exit code."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", "*.py"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\0")
    bare = [
        name
        for name in filter(None, listed)
        if (text := (ROOT / name).read_text(encoding="utf-8")) and not text.startswith(HEADER)
    ]
    for name in bare:
        print(f"{name}: starts without the licence header (copy it from scripts/{pathlib.Path(__file__).name})")
    return bool(bare)


if __name__ == "__main__":
    sys.exit(main())
