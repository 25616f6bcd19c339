# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

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
