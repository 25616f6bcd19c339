# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The rules that `check` holds a bag against, and what happens if one is broken.

They are those of rosbag2's Jazzy branch, of the MCAP specification and registry, and of the
readers that are in use; docs/bags.md lists them.
"""

import enum
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial

from gait_entrainment_bags.errors import noting


class Severity(enum.Enum):
    """How much a broken rule matters."""

    ERROR = "error"  # a reader fails, or data is lost or wrong
    WARNING = "warning"  # readers manage, with less


_CONSEQUENCES = {
    "mcap": "no reader opens it",
    "closed": "rosbags refuses it, rosbag2 has to scan it; `entrain bag recover` makes it whole",
    "intact": "readers stop there or give wrong data; `entrain bag recover` saves the rest",
    "summary": "a reader has to go through the whole file to know what is in it, or falls back to "
    "the order of the file",
    "profile": "rosbags rejects the file",
    "schema": "rosbag2 throws when it opens the file",
    "schema-name": "rosbag2 finds no message package for it and skips the topic",
    "schema-encoding": "viewers and decoders without the message package skip the topic",
    "schema-text": "viewers and decoders without the message package skip the topic",
    "message-encoding": "rosbag2 and rosbags cannot read the topic",
    "offered-qos": "players publish with default QoS, so that late or reliable subscribers may "
    "get nothing",
    "qos-version": "rosbag2 throws when it opens the file",
    "type-hash": "nobody can tell whether an installed definition is the recorded one",
    "one-type": "readers decode one part of the topic by the wrong definition",
    "cdr-header": "the message cannot be deserialized",
    "message": "viewers and decoders fail on the topic",
    "chunk-index": "readers fall back to the order of the file",
    "message-index": "readers fall back to the order of the file, or miss messages",
    "statistics": "numbers and times that readers show or seek by are wrong",
    "rosbag2-record": "custom data and QoS are lost with metadata.yaml",
    "metadata-file": "rosbag2 does not open the folder; `ros2 bag reindex` makes it anew",
    "metadata-key": "rosbag2 throws when it opens the folder",
    "metadata-version": "rosbag2 of Jazzy does not read it",
    "metadata-qos": "rosbag2 throws when it opens the folder",
    "metadata-files": "rosbag2 does not open the bag, or leaves a file out",
    "metadata-topics": "rosbag2 does not play the topic, or shows wrong numbers",
    "metadata-times": "`ros2 bag info` shows wrong times, start offsets go astray",
}
_WARNINGS = [
    "summary",
    "offered-qos",
    "type-hash",
    "chunk-index",
    "message-index",
    "rosbag2-record",
]
RULES = {
    rule: (Severity.WARNING if rule in _WARNINGS else Severity.ERROR, consequence)
    for rule, consequence in _CONSEQUENCES.items()
}
"""Severity and consequence by rule."""


@dataclass(frozen=True)
class Finding:
    """A broken rule: where and how (`detail`), and which reader fails in what way."""

    rule: str
    severity: Severity
    detail: str
    consequence: str

    def __str__(self) -> str:
        return f"{self.severity.value}: {self.rule}: {self.detail}: {self.consequence}"


class Report:
    """Gathers where rules are broken."""

    def __init__(self) -> None:
        self._places: dict[str, list[str]] = {}

    def add(self, rule: str, detail: str) -> None:
        """Note a place where a rule is broken."""
        self._places.setdefault(rule, []).append(detail)

    def adding(self, rule: str) -> AbstractContextManager[None]:
        """Note what cannot be read as a breach of this rule."""
        return noting(partial(self.add, rule))

    def findings(self) -> list[Finding]:
        """Give one finding for each broken rule: the first place, and how many more there are."""
        found = []
        for rule, (severity, consequence) in RULES.items():
            if places := self._places.get(rule):
                more = f" (and {len(places) - 1} more)" if len(places) > 1 else ""
                found.append(Finding(rule, severity, places[0] + more, consequence))
        return found
