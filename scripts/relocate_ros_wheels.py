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

"""
Make the CMake files of the ROS 2 wheels name this environment.

The wheels were built elsewhere, and the CMake files that they export still name the directories
of that machine's Python. A message package that depends on another one then fails to find
Python.h and numpy. Running this twice changes nothing the second time.
"""

import pathlib
import re
import sys
import sysconfig

BUILD_MACHINE = re.compile(
    r"/opt/python/cp(?P<tag>3\d+)-cp(?P=tag)/(?P<rest>include/python3\.\d+|lib/python3\.\d+/site-packages)"
)


def relocated(text: str, include: str, site_packages: str) -> str:
    """Return the text of a CMake file with the build machine's directories replaced."""
    return BUILD_MACHINE.sub(
        lambda found: include if found["rest"].startswith("include") else site_packages, text
    )


def main() -> None:
    """Rewrite the CMake files under this interpreter's environment where they need it."""
    paths = sysconfig.get_paths()
    for file in sorted(pathlib.Path(sys.prefix, "share").glob("**/*.cmake")):
        before = file.read_text(encoding="utf-8")
        after = relocated(before, paths["include"], paths["purelib"])
        if after != before:
            file.write_text(after, encoding="utf-8")


if __name__ == "__main__":
    main()
