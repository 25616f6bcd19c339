# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Late matching and late delivery between any two nodes: a switch for tests of races.

Discovery and delivery take time, but usually too little to reveal a node that does not wait for
them. The environment variable GAIT_ENTRAINMENT_DELAYS makes them take longer: a JSON object of
delays by pairs ``sender>receiver``, where ``*`` matches any name and the first match counts. For
example, with the time of matching in seconds since 1970::

    {"bag_recorder>walker_sim": {"matched": 1795708000.5}, "*>*": {"delivery": 0.02}}

If it is unset, as it is outside tests, nothing here is used.
"""

import json
import os
import zlib
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

VARIABLE = "GAIT_ENTRAINMENT_DELAYS"


class Delay(NamedTuple):
    """
    How late a receiver hears a sender.

    Before ``matched``, wall time [s since 1970], it hears nothing, and the sender knows that.
    Afterwards each topic is late by its own share of ``delivery`` [s], so topics overtake each
    other.
    """

    matched: float = 0.0
    delivery: float = 0.0

    def of_topic(self, name: str) -> float:
        """Return how late a topic is delivered [s]."""
        return self.delivery * zlib.crc32(name.encode()) / 2**32


def delays_wanted() -> bool:
    """Return whether the switch is on."""
    return VARIABLE in os.environ


def delay_between(sender: str, receiver: str) -> Delay:
    """Return how late a receiver hears a sender, by the names of the nodes."""
    chosen = json.loads(os.environ.get(VARIABLE, "{}"))
    pair = f"{sender}>{receiver}"
    return next((Delay(**d) for p, d in chosen.items() if fnmatchcase(pair, p)), Delay())


def unmatched_by_delay(node: Any, topic: str, now: float) -> int:
    """Return how many subscriptions of a topic a node must not have matched yet, ``now`` [s]."""
    if not delays_wanted():
        return 0
    readers = node.get_subscriptions_info_by_topic(topic)
    return sum(now < delay_between(node.get_name(), r.node_name).matched for r in readers)
