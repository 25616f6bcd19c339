# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What holds up a publisher: readers on this host whose process is suspended.

Fast DDS (2.x) puts the lower half of the process ID into bytes 4 and 5 of each endpoint's GID.
With another middleware no process is found.
"""

from pathlib import Path
from typing import Any


def who_hangs(node: Any) -> str:
    """Return which readers in a node's domain hold up the rest, as the end of a message."""
    stopped = _suspended_processes()
    found = {
        stopped[number]
        for topic, _ in node.get_topic_names_and_types()
        for reader in node.get_subscriptions_info_by_topic(topic)
        if (number := int.from_bytes(bytes(reader.endpoint_gid[4:6]), "little")) in stopped
    }
    return "".join(f"; held up by process {process}, which is suspended" for process in found)


def _suspended_processes() -> dict[int, str]:
    """Return the processes of this host that are suspended, by the lower half of their ID."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, state = stat.read_text().rpartition(")")[::2]
        except OSError:  # it has just ended
            continue
        if state.split()[0] == "T":
            number, _, command = name.partition(" (")
            found[int(number) & 0xFFFF] = f"{number} ({command})"
    return found
