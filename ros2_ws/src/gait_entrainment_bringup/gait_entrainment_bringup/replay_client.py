# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client of a replay: starts the player, and collects what the analyzer publishes."""

from std_srvs.srv import Trigger
from tqdm import tqdm

from gait_entrainment_bringup.node_list import REPLAY_NODES
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_bringup.watch import Watch
from gait_entrainment_msgs.msg import PublishedCounts
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import TIMEOUT, Client
from gait_entrainment_nodes.messaging.errors import SilenceError
from gait_entrainment_nodes.messaging.player_services import srv
from gait_entrainment_nodes.messaging.topics import PUBLISHED_COUNTS, STRIDES
from gait_entrainment_nodes.nodes.gait_analyzer_run import RESULTS


class ReplayClient(Client):
    """
    Has a bag played to a gait analyzer, and collects the analyzer's results.

    ``namespace`` is that of the replay, without a trailing slash; ``recorded`` is whether a
    recorder listens too. ``results`` are serialized messages by relative topic name, in the order
    in which they were published.
    """

    def __init__(self, supervisor: Supervisor, namespace: str, *, recorded: bool) -> None:
        super().__init__("entrain_replay", namespace=namespace)
        self._supervisor, self._beneath, self._recorded = supervisor, f"{namespace}/", recorded
        self._counts: dict[str, int] | None = None  # of messages that the analyzer has published
        self.results: dict[str, list[bytes]] = {topic.name: [] for topic in RESULTS.values()}
        for topic in RESULTS.values():
            self.subscribe(topic, self.results[topic.name].append, raw=True)
        self.subscribe(PUBLISHED_COUNTS, self._on_counts)
        # Player and recorder end by themselves once everything has been played and recorded.
        may_end = ("bag_player", "bag_recorder")
        self.each_round = Watch(
            self, supervisor, may_end=may_end, asked=REPLAY_NODES, silence=TIMEOUT
        )

    def play(self, *, quiet: bool) -> None:
        """Play the bag and wait for all of the analyzer's results; NodeError if a node fails."""
        for node in REPLAY_NODES:
            self.call(Ready, f"{node}/ready", accept=self._all_listen)
        self.call(srv.Resume, "bag_player/resume")
        bar = tqdm(desc="replay", unit="stride", disable=True if quiet else None, leave=False)

        def played() -> bool:
            bar.update(len(self.results[STRIDES.name]) - bar.n)
            return "bag_player" in self._supervisor.ended()

        with bar:
            self.wait(played)
        self.call(Trigger, "gait_analyzer/finish")
        if not self.wait(self._complete, TIMEOUT):
            raise SilenceError("gait_analyzer/finish", TIMEOUT)

    def _all_listen(self, answer: Ready.Response) -> bool:
        """Whether a node is ready and will be heard by this client and by a recorder, if any."""
        heard_here = {self._beneath + name for name in (*self.results, PUBLISHED_COUNTS.name)}
        return answer.ready and all(
            matched >= (topic in heard_here) + self._recorded
            for topic, matched in zip(answer.topics, answer.matched, strict=True)
            # A recorder hears the topics in its namespace, except hidden ones.
            if topic.startswith(self._beneath) and "/_" not in topic
        )

    def _complete(self) -> bool:
        """Whether everything that the analyzer has published has arrived."""
        return self._counts is not None and all(
            len(messages) >= self._counts[self._beneath + name]
            for name, messages in self.results.items()
        )

    def _on_counts(self, message: PublishedCounts) -> None:
        if message.node.rpartition("/")[2] == "gait_analyzer":
            self._counts = dict(zip(message.topics, message.counts, strict=False))
