# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""docs/architecture.md agrees with topics.py, and names files and packages that exist."""

import re
from enum import Enum
from operator import attrgetter
from pathlib import Path

from gait_entrainment.protocol import DEFAULT_PROTOCOL, FIELDS
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_sensors.sources import ENCODER, FOOT, SHANK, SWITCH

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "ros2_ws/src"
PAGE = (ROOT / "docs/architecture.md").read_text()
QUALITIES = {
    "every message": topics.EVERY_MESSAGE,
    "latest state": topics.LATEST_STATE,
    "viewed": topics.VIEWED,
    "said once": topics.SAID_ONCE,
    "from a button": topics.FROM_A_BUTTON[0],
    "looking on": topics.LOOKING_ON,
    "heartbeat": topics.HEARTBEAT,
    "from a driver": topics.FROM_A_DRIVER,
}


def rows(first_column, page=PAGE):
    """Return the rows of the table whose head begins with a word, cell by cell."""
    table = re.search(rf"^\| {first_column} \|.*\n\|.*\n((?:\|.*\n)+)", page, re.MULTILINE)[1]
    return [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in table.splitlines()]


def type_name(message_type):
    package = message_type.__module__.partition(".")[0]
    own = package == "gait_entrainment_msgs"
    return message_type.__name__ if own else f"{package}/{message_type.__name__}"


def test_topics_have_the_type_and_quality_given_on_the_page():
    named = [t if type(t) is tuple else (t,) for t in vars(topics).values()]
    named += map(topics.sensor_topics, (SWITCH, FOOT, SHANK, ENCODER))
    actual = {
        topic.name: (type_name(topic.type), topic.qos)
        for group in named
        for topic in group
        if isinstance(topic, topics.Topic)
    }
    assert {row[0]: (row[1], QUALITIES[row[3]]) for row in rows("topic")} == actual


def test_qualities_are_those_on_the_page():
    stated = {row[0]: " ".join(row[1:4]) for row in rows("quality")}
    for name, qos in QUALITIES.items():
        history = qos.history.name.lower() + (f" {qos.depth}" if qos.depth else "")
        words = (history, qos.reliability.name.lower(), qos.durability.name.lower())
        durability = "volatile" if words[2] == "system_default" else words[2]
        assert stated.pop(name) == f"{words[0]} {words[1]} {durability}".replace("_", " ")
    assert stated == {}


def test_packages_are_those_of_the_workspace():
    assert {row[0] for row in rows("package")} == {
        p.parent.name for p in SOURCES.glob("*/package.xml")
    }


def test_all_fields_of_a_protocol_are_listed_with_their_defaults():
    page = (ROOT / "docs/protocols.md").read_text()
    stated = {name: default for name, default, _ in rows("field", page)}
    fields = [name for name in FIELDS if not name.startswith(("walker.", "limits."))]
    assert set(stated) == set(fields)
    for name in fields:
        default = attrgetter(name)(DEFAULT_PROTOCOL)
        text = default.name.lower() if isinstance(default, Enum) else default
        text = str(text).lower() if isinstance(text, bool) else text
        text = "" if text is None else f"{text:g}" if isinstance(text, float) else str(text)
        assert stated[name].removesuffix(" s") == text, name


def test_files_named_on_the_page_exist():
    paths = re.findall(r"gait_entrainment\w*/[\w/.]*", str(rows("question")))
    assert len(paths) > 15
    for path in paths:
        # A Python package is the folder of its own name in the ROS package.
        package = path.partition("/")[0]
        places = (SOURCES / package / path, SOURCES / package / f"{path}.py", SOURCES / path)
        assert any(place.exists() for place in places), path


def test_links_lead_to_files():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *ROOT.glob("examples/*/*.md")]
    for page in pages:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
