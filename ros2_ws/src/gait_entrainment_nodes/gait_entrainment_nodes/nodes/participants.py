# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The nodes that take part in an experiment: whether all are running and hear each other."""

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.topics import GAIT_EVENTS, TORQUE_PROFILE, WALKER_PROGRESS
from gait_entrainment_nodes.nodes.experiment_run import RECORDER, ExperimentError
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.waiting import Waiting

# A participant that has not answered is asked again after this long [s].
ASK_AGAIN = 0.5


class ClockError(ExperimentError):
    """A participant's clock is off, which waiting does not change."""


@dataclass(frozen=True)
class ClockOffset:
    """How far a participant's clock is ahead, measured by a request and its answer."""

    offset: float  # [s]
    uncertainty: float  # half the time from request to answer [s]

    @classmethod
    def measured(cls, asked: int, reported: int, answered: int) -> "ClockOffset":
        """Return the offset of a clock that was read between two times of this one [ns]."""
        middle = (asked + answered) / 2
        uncertainty = (answered - asked) / 2 / NANOSECONDS_PER_SECOND
        return cls((reported - middle) / NANOSECONDS_PER_SECOND, uncertainty)

    def check(self, name: str, longest: float) -> None:
        """Raise ClockError if the offset exceeds a limit [s], ExperimentError if unknown."""
        if abs(self.offset) - self.uncertainty > longest:
            way = "ahead of" if self.offset > 0 else "behind"
            raise ClockError(
                f"the clock of {name} is {1e3 * abs(self.offset):.1f} ms {way} this one; allowed: "
                f"{1e3 * longest:g} ms: synchronize the hosts (docs/hosts.md)",
                name,
            )
        if self.uncertainty > longest:
            raise ExperimentError(f"{name} answers too slowly to compare its clock", name)


class Participants:
    """
    The participants of an experiment before a run: any nodes in its namespace with ``~/ready``.

    The other clients of the experiment, ``node``, exist already: discovery announces clients in
    the order of their creation, so a participant that answers here knows all of them.
    """

    def __init__(self, node: Participant, names: Sequence[str], waiting: Waiting) -> None:
        self.names = tuple(names)
        self._node, self._waiting = node, waiting
        self._clients = {name: node.client(Ready, f"{name}/ready") for name in names}

    async def check(self, longest_clock_offset: float) -> None:
        """
        Raise ExperimentError if a participant is not ready, or if publishers rival each other.

        Raises ClockError if a clock is off by more than a limit [s]; 0 compares no clocks.
        """
        here = self._node.get_namespace()
        nodes = self._node.get_node_names_and_namespaces()
        for name, client in self._clients.items():
            if not client.service_is_ready():
                raise ExperimentError(f"{name} does not answer", name)
            if nodes.count((name, here)) > 1:
                raise ExperimentError(
                    f"there are two {name} in {here}: another experiment runs here; choose "
                    "another namespace or ROS_DOMAIN_ID",
                    name,
                )
        for name, client in self._clients.items():
            # An answer may be lost as long as the participant has not discovered this client.
            asked = time.time_ns()
            answer = client.call_async(Ready.Request())
            silence = ExperimentError(f"{name} does not answer", name)
            await self._waiting.until(answer.done, ASK_AGAIN, silence)
            state = answer.result()
            if longest_clock_offset:
                stamp = nanoseconds_of(state.now)
                offset = ClockOffset.measured(asked, stamp, time.time_ns())
                offset.check(name, longest_clock_offset)
            if not state.ready:
                raise ExperimentError(f"{name} waits for {state.waiting_for}", name)
            self._require_recorded(name, state.topics)
            # This node may have discovered more subscriptions than the participant.
            for topic, matched in zip(state.topics, state.matched, strict=True):
                if matched < self._node.count_subscribers(topic):
                    raise ExperimentError(f"{name} waits for subscriptions of {topic}", name)
        self._require_recorded(self._node.get_name(), self._node.matched)
        for single in (GAIT_EVENTS, WALKER_PROGRESS, TORQUE_PROFILE):
            if rivals := self._node.rivals(single):
                raise ExperimentError(rivals)

    def _require_recorded(self, name: str, topics: Iterable[str]) -> None:
        """Raise ExperimentError if there is a recorder that has not subscribed to a topic."""
        if RECORDER not in self.names or name == RECORDER:
            return
        here = self._node.get_namespace()
        for topic in topics:
            readers = self._node.get_subscriptions_info_by_topic(topic)
            heard = (RECORDER, here) in {(r.node_name, r.node_namespace) for r in readers}
            if topic.startswith(here.rstrip("/") + "/") and not heard:
                raise ExperimentError(f"{RECORDER} has not subscribed to {topic}", RECORDER)
