# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Who holds up a publisher: readers on this host whose process is suspended.

Fast DDS (2.x) puts the lower half of the process's number into bytes 4 and 5 of the identity of
each of its endpoints. With another middleware nobody is found.
"""

from pathlib import Path
from typing import Any


def suspended_readers(node: Any, publisher: str, namespace: str) -> list[str]:
    """Return the readers of a node's topics whose process is suspended, each in words."""
    stopped = _suspended_processes()
    found = []
    for topic, _ in node.get_publisher_names_and_types_by_node(publisher, namespace):
        for reader in node.get_subscriptions_info_by_topic(topic):
            process = stopped.get(int.from_bytes(bytes(reader.endpoint_gid[4:6]), "little"))
            if process is not None:
                found.append(f"{reader.node_name} (process {process}) is suspended")
    return list(dict.fromkeys(found))


def _suspended_processes() -> dict[int, int]:
    """Return the processes of this host that are suspended, by the lower half of their number."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state = stat.read_text().rpartition(")")[2].split()[0]
        except OSError:  # it has ended meanwhile
            continue
        if state == "T":
            found[int(stat.parent.name) & 0xFFFF] = int(stat.parent.name)
    return found
