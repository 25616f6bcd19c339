# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client of a replay: starts the player, hears the analyzer out."""

from collections.abc import Callable

from std_srvs.srv import Trigger
from tqdm import tqdm

from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_bringup.watch import Watch
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.errors import SilenceError
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.topics import (
    ENTRAINMENT,
    PUBLISHED_COUNTS,
    PULSE_PHASES,
    STRIDES,
)

RESULTS = (STRIDES, PULSE_PHASES, ENTRAINMENT)
# How long a node may take to appear and to do what it is asked for, and may be silent [s].
PATIENCE = 60.0


class ReplayClient(Client):
    """
    Lets a bag be played to a gait analyzer, and takes what the analyzer makes of it.

    Parameters
    ----------
    supervisor
        The processes to watch meanwhile.
    namespace
        Of the replay, without a slash at its end; "" for the root.
    recorded
        Whether a recorder listens, too.

    Attributes
    ----------
    results
        Serialized messages by relative topic name, in the order in which they were published.

    """

    def __init__(self, supervisor: Supervisor, namespace: str, *, recorded: bool) -> None:
        super().__init__("entrain_replay", namespace=namespace)
        self._supervisor, self._namespace, self._recorded = supervisor, namespace, recorded
        self._listeners = 2 if recorded else 1  # to what the analyzer publishes
        self._counts: dict[str, int] | None = None  # of messages that it says it has published
        self.results: dict[str, list[bytes]] = {topic.name: [] for topic in RESULTS}
        for topic in RESULTS:
            self.subscribe(topic, self.results[topic.name].append, raw=True)
        self.subscribe(PUBLISHED_COUNTS, self._on_counts)
        # Player and recorder end by themselves once everything was played and recorded.
        self.each_round = Watch(
            self,
            supervisor,
            may_end=("bag_player", "bag_recorder"),
            asked=("gait_analyzer", "bag_player"),
            silence=PATIENCE,
        )

    def play(self, *, quiet: bool) -> None:
        """
        Play the bag to its end and wait for everything that the analyzer makes of it.

        Raises
        ------
        NodeError
            if a node fails or falls silent.

        """
        self._wait_for("gait_analyzer", self._all_listen)
        self._wait_for("bag_player", self._all_recorded)
        self.call(srv.Resume, "bag_player/resume", patience=PATIENCE)
        bar = tqdm(desc="replay", unit="stride", disable=True if quiet else None, leave=False)

        def played() -> bool:
            bar.update(len(self.results[STRIDES.name]) - bar.n)
            return "bag_player" in self._supervisor.ended()

        with bar:
            self.wait(played)
        self.call(Trigger, "gait_analyzer/finish", patience=PATIENCE)
        if not self.wait(self._complete, PATIENCE):
            raise SilenceError("gait_analyzer/finish", PATIENCE)

    def _wait_for(self, node: str, enough: Callable[[dict[str, int]], bool]) -> None:
        """Wait until a node is ready and has matched enough subscriptions, by topic."""
        self.call(
            Ready,
            f"{node}/ready",
            accept=lambda a: a.ready and enough(dict(zip(a.topics, a.matched, strict=True))),
            patience=PATIENCE,
        )

    def _all_listen(self, matched: dict[str, int]) -> bool:
        """Whether everyone who is to hear the analyzer's results will hear them."""
        names = map(self.node.resolve_topic_name, (*self.results, PUBLISHED_COUNTS.name))
        return all(matched.get(name, 0) >= self._listeners for name in names)

    def _all_recorded(self, matched: dict[str, int]) -> bool:
        """Whether a recorder, if there is one, hears all of its namespace, hidden topics apart."""
        if not self._recorded:
            return True
        beneath = f"{self._namespace}/"
        recorded = [name for name in matched if name.startswith(beneath) and "/_" not in name]
        # The final counts are heard here too.
        counts = self.node.resolve_topic_name(PUBLISHED_COUNTS.name)
        return matched[counts] >= self._listeners and all(map(matched.get, recorded))

    def _complete(self) -> bool:
        """Whether everything that the analyzer says it has published is here."""
        return self._counts is not None and all(
            len(messages) >= self._counts[self.node.resolve_topic_name(name)]
            for name, messages in self.results.items()
        )

    def _on_counts(self, message: PublishedCounts) -> None:
        if message.node.rpartition("/")[2] == "gait_analyzer":
            self._counts = dict(zip(message.topics, message.counts, strict=True))
