# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""While a client waits: which nodes have ended early, and which have fallen silent."""

import time
from collections.abc import Collection

from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.errors import NodeError
from gait_entrainment_nodes.messaging.readers import who_hangs
from gait_entrainment_nodes.nodes.waiting import HELD_UP


class Watch:
    """
    Called in each round of a client, ends its waiting by a NodeError that names the culprit.

    Of the supervisor's processes only those that ``may_end`` end by themselves. Nodes that are
    ``asked`` for signs of life may owe one for a time of ``silence`` [s], once they have answered;
    they are asked six times as often. ``silence`` may be changed at any time.
    """

    def __init__(
        self,
        client: Client,
        supervisor: Supervisor,
        *,
        may_end: Collection[str],
        asked: Collection[str],
        silence: float,
    ) -> None:
        self._client, self._supervisor = client, supervisor
        self._may_end, self.silence = may_end, silence
        never, period = (lambda _: False), silence / 6
        self._signs = {
            node: client.ask(Ready, f"{node}/ready", accept=never, period=period) for node in asked
        }
        self._looked_at = self._since = time.monotonic()

    def __call__(self) -> None:
        """Look once."""
        ended = self._supervisor.check(self._may_end)
        now = time.monotonic()
        if now - self._looked_at > HELD_UP * self.silence:
            self._since = now
        self._looked_at = now
        for node, sign in self._signs.items():
            sign.answer()
            answers = sign.latest is not None and node not in ended
            if answers and now - max(sign.answered_at, self._since) > self.silence:
                silent = f"{node} has been silent for {self.silence:g} s"
                raise NodeError(silent + who_hangs(self._client.node), node)
