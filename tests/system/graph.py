# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Draw the graph of nodes and topics in Mermaid, as live nodes report it.

``python tests/system/graph.py`` starts the nodes and redraws the graph in README.md.
"""

import re
import tempfile
from pathlib import Path

from harness import Probe, session

from gait_entrainment_bringup.node_list import NODES

README = Path(__file__).parents[2] / "README.md"
BLOCK = re.compile(r"```mermaid\n.*?```\n", re.DOTALL)
# Topics that every node publishes, and the node that reads every topic.
OF_ALL = ("rosout", "parameter_events", "diagnostics", "published_counts")
RECORDER = "bag_recorder"


def topics(endpoints: list[tuple[str, list[str]]]) -> set[str]:
    """Return those of a node's topics that the graph shows."""
    names = {name.strip("/") for name, _ in endpoints}
    return {name for name in names if "/_" not in name and name not in OF_ALL}


def graph(probe: Probe) -> str:
    """Return the graph of an experiment, as any node in its domain sees it."""
    node = probe.node
    probe.until(lambda: set(NODES) <= set(node.get_node_names()), "the names of all nodes")
    published = {n: topics(node.get_publisher_names_and_types_by_node(n, "/")) for n in NODES}
    read = {n: topics(node.get_subscriber_names_and_types_by_node(n, "/")) for n in NODES}
    # Topics from one node to the same readers share a box.
    boxes: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for publisher in NODES:
        for topic in sorted(published[publisher]):
            readers = tuple(n for n in NODES if topic in read[n] and n != RECORDER)
            boxes.setdefault((publisher, readers), []).append(topic)
    lines = ["```mermaid", "flowchart LR"]
    lines += [f"    {name}([{name}])" for name in NODES]
    for number, ((publisher, readers), names) in enumerate(sorted(boxes.items())):
        lines.append(f'    {publisher} --> t{number}["{"<br>".join(names)}"]')
        lines += [f"    t{number} --> {reader}" for reader in readers]
    lines.append(f'    all["every topic"] --> {RECORDER}')
    for client in NODES:
        used: dict[str, set[str]] = {}
        for name, _ in node.get_client_names_and_types_by_node(client, "/"):
            server, _, service = name.strip("/").replace("/_action", "").partition("/")
            server = {"walker": "walker_sim"}.get(server, server)  # which plays the role here
            if service != "ready":
                used.setdefault(server, set()).add(service.partition("/")[0])
        for server, services in sorted(used.items()):
            lines.append(f"    {client} -. {', '.join(sorted(services))} .-> {server}")
    return "\n".join([*lines, "```", ""])


def main() -> None:
    """Redraw the graph in README.md."""
    with tempfile.TemporaryDirectory() as folder, session(Path(folder), real_time=False) as nodes:
        drawn = graph(nodes.probe)
    README.write_text(BLOCK.sub(lambda _: drawn, README.read_text(), count=1))


if __name__ == "__main__":
    main()
