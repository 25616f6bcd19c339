# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The layouts for RViz, Foxglove and PlotJuggler name only what the nodes publish."""

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import yaml

from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.topics import MARKERS, ROBOT_DESCRIPTION, Topic

PACKAGE = Path(__file__).parents[1]
TYPES = {
    f"/{topic.name.lstrip('/')}": topic.type
    for topic in vars(topics).values()
    if isinstance(topic, Topic)
}
FRAMES = {"world", "base_footprint", "base_link", "l_leg", "r_leg", "l_sole", "r_sole"}
DRAWN = {f"/{ROBOT_DESCRIPTION.name}", f"/{MARKERS.name}"}


def number_at(path, separator):
    """Return the default of the number at a path of topic, fields and index."""
    topic = max((t for t in TYPES if path.startswith(t + separator)), key=len, default="")
    assert topic, f"{path}: no such topic"
    value = TYPES[topic]()
    for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", path[len(topic) :]):
        assert name in value.get_fields_and_field_types(), f"{path}: no field {name}"
        value = getattr(value, name)
        if index:
            value = value[int(index)]
    return float(value)


def test_foxglove_layout():
    layout = json.loads((PACKAGE / "layouts" / "foxglove.json").read_text())
    panels = layout["configById"]

    def shown(node):
        if isinstance(node, str):
            return [node]
        assert node["direction"] in ("row", "column")
        assert 0 < node["splitPercentage"] < 100
        return shown(node["first"]) + shown(node["second"])

    assert sorted(shown(layout["layout"])) == sorted(panels)
    paths = []
    for name, panel in panels.items():
        kind = name.partition("!")[0]
        assert kind in ("3D", "Plot", "StateTransitions")
        if kind == "3D":
            assert panel["topics"].keys() == DRAWN
            frames = {panel["followTf"], *(g["frameId"] for g in panel["layers"].values())}
            assert frames <= FRAMES
        else:
            paths += [path["value"] for path in panel["paths"]]
    assert len(paths) > 8
    for path in paths:
        number_at(path, ".")


def test_plotjuggler_layout():
    root = ElementTree.parse(PACKAGE / "layouts" / "plotjuggler.xml").getroot()
    (splitter,) = root.findall("tabbed_widget/Tab/Container/DockSplitter")
    plots = splitter.findall("DockArea/plot")
    assert len(plots) == int(splitter.get("count")) == len(splitter.get("sizes").split(";"))
    for plot in plots:
        curves = [curve.get("name") for curve in plot.findall("curve")]
        assert curves
        for curve in curves:
            number_at(curve, "/")


def test_rviz_configuration():
    config = yaml.safe_load((PACKAGE / "rviz" / "walker.rviz").read_text())
    manager = config["Visualization Manager"]
    named = {}
    for display in manager["Displays"]:
        kind = display["Class"].removeprefix("rviz_default_plugins/")
        assert kind in ("Grid", "RobotModel", "MarkerArray", "TF")
        topic = display.get("Topic") or display.get("Description Topic")
        if topic:
            named[topic["Value"]] = topic
    assert named.keys() == DRAWN
    for topic in (ROBOT_DESCRIPTION, MARKERS):
        chosen = named[f"/{topic.name}"]
        for policy in ("durability", "reliability"):
            offered = getattr(topic.qos, policy).name.replace("_", " ").title()
            assert chosen[f"{policy.title()} Policy"] == offered
    assert manager["Global Options"]["Fixed Frame"] in FRAMES
    assert manager["Views"]["Current"]["Target Frame"] in FRAMES
