# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The graph of nodes and topics, in Mermaid, from what live nodes say of themselves.

``python tests/system/graph.py`` starts the nodes and draws the graph in README.md anew.
"""

import re
import tempfile
from pathlib import Path

from harness import Probe, session

from gait_entrainment_bringup.node_list import NODES

README = Path(__file__).parents[2] / "README.md"
BLOCK = re.compile(r"```mermaid\n.*?```\n", re.DOTALL)
# What every node publishes; and who reads every topic.
OF_ALL = ("rosout", "parameter_events", "diagnostics", "published_counts")
RECORDER = "bag_recorder"


def topics(ends: list[tuple[str, list[str]]]) -> set[str]:
    """Return the topics that a graph of this size shows, of those that a node has an end of."""
    names = {name.strip("/") for name, _ in ends}
    return {name for name in names if "/_" not in name and name not in OF_ALL}


def graph(probe: Probe) -> str:
    """Return the graph of an experiment, as any node in its domain sees it."""
    node = probe.node
    probe.until(lambda: set(NODES) <= set(node.get_node_names()), "the names of all nodes")
    made = {n: topics(node.get_publisher_names_and_types_by_node(n, "/")) for n in NODES}
    read = {n: topics(node.get_subscriber_names_and_types_by_node(n, "/")) for n in NODES}
    # Topics from one node to the same others share a box.
    boxes: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for maker in NODES:
        for topic in sorted(made[maker]):
            readers = tuple(n for n in NODES if topic in read[n] and n != RECORDER)
            boxes.setdefault((maker, readers), []).append(topic)
    lines = ["```mermaid", "flowchart LR"]
    lines += [f"    {name}([{name}])" for name in NODES]
    for number, ((maker, readers), names) in enumerate(sorted(boxes.items())):
        lines.append(f'    {maker} --> t{number}["{"<br>".join(names)}"]')
        lines += [f"    t{number} --> {reader}" for reader in readers]
    lines.append(f'    all["every topic"] --> {RECORDER}')
    for asker in NODES:
        asked: dict[str, set[str]] = {}
        for name, _ in node.get_client_names_and_types_by_node(asker, "/"):
            server, _, service = name.strip("/").replace("/_action", "").partition("/")
            server = {"walker": "walker_sim"}.get(server, server)  # who plays the role here
            if service != "ready":
                asked.setdefault(server, set()).add(service.partition("/")[0])
        for server, services in sorted(asked.items()):
            lines.append(f"    {asker} -. {', '.join(sorted(services))} .-> {server}")
    return "\n".join([*lines, "```", ""])


def main() -> None:
    """Draw the graph in README.md anew."""
    with tempfile.TemporaryDirectory() as folder, session(Path(folder), real_time=False) as nodes:
        drawn = graph(nodes.probe)
    README.write_text(BLOCK.sub(lambda _: drawn, README.read_text(), count=1))


if __name__ == "__main__":
    main()
