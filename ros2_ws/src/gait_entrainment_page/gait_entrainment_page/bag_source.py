# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A recorded bag as the page shows it: the view at any time of the record."""

import threading
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags import topic_names as names
from gait_entrainment_page.view import KEPT, SAMPLED, View

# Sampled topics are read from the bag for this long before the time shown [ns]. The others are
# decoded once: a bag of hours has some ten thousand such messages.
_WINDOW = 8 * NANOSECONDS_PER_SECOND


class BagSource:
    """
    Shows a bag, a folder or an ``.mcap`` file, at the requested time.

    ``start`` and ``end`` are the first and the last time [ns]; ``lacking`` names what the page
    would show but the bag lacks. Raises BagError if it is not a bag or has no gait events.
    """

    def __init__(self, path: Path, *, blinded: bool = False) -> None:
        self._bag = BagReader(path)
        self._lock = threading.Lock()
        recorded = self._bag.find_topic(names.GAIT_EVENTS)
        if recorded is None:
            raise BagError(f"{path}: not a run of this project: no gait events")
        self.path, self._namespace = path, recorded.removesuffix(names.GAIT_EVENTS)
        present = [n for n in KEPT if self._namespace + n in self._bag.topics]
        self._messages = [
            (raw.log_time, raw.topic.removeprefix(self._namespace), message)
            for raw, message in self._bag.decoded([self._namespace + name for name in present])
        ]
        self._messages.sort(key=lambda entry: entry[0])
        if not self._messages:
            raise BagError(f"{path}: nothing to show: no gait event and no stride")
        self.start, self.end = self._messages[0][0], self._messages[-1][0]
        wanted = {
            names.EXPERIMENT_STATE: "parts of the protocol",
            names.STRIDES: "strides",
            names.ENTRAINMENT: "verdicts",
            names.ROBOT_STATE: "states of the robot",
            names.JOINT_STATES: "joint angles",
        }
        counts = self._bag.counts
        self.lacking = [w for n, w in wanted.items() if not counts.get(self._namespace + n)]
        self.view = View(blinded=blinded)
        self.record = (
            f"{self._bag.message_count} messages, {self._bag.size / 1e6:.1f} MB, "
            f"{self._bag.duration / NANOSECONDS_PER_SECOND:.0f} s"
        )
        self.show(self.end)

    def show(self, instant: int) -> None:
        """Bring the view to a time [ns], unless another one is requested meanwhile."""
        self._requested = instant
        with self._lock:  # of the reader: the view itself stays free
            if instant != self._requested:
                return
            samples = self._samples(instant)
            fresh = View(blinded=self.view.blinded)
            fresh.version = self.view.version + 1
            entries = [entry for entry in self._messages if entry[0] <= instant]
            # Readings must come before the stride that they belong to.
            entries = sorted([*samples, *entries], key=lambda entry: entry[0])
            for _, topic, message in entries:
                fresh.take(topic, message)
            fresh.now = instant
            fresh.lock = self.view.lock
            self.view = fresh

    def _samples(self, instant: int) -> list[tuple[int, str, Any]]:
        topics = [self._namespace + name for name in SAMPLED]
        topics = [topic for topic in topics if topic in self._bag.topics]
        found = self._bag.decoded(topics, max(instant - _WINDOW, 0), instant + 1)
        return [(r.log_time, r.topic.removeprefix(self._namespace), m) for r, m in found]

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()
