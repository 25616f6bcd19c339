# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Entry point of the node's executable."""

from gait_entrainment_nodes import executable


def main() -> int:
    """Run the node to its end and return its exit code."""
    return executable.main("gait_entrainment_page")
