# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Watch, while a client waits, for nodes that end early or fall silent."""

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
    Called in each round of a client; ends its wait with a NodeError that names the culprit.

    Only those of the supervisor's processes in ``may_end`` may end by themselves. Nodes in
    ``asked`` are asked for a sign of life six times per ``silence`` [s]; once they have answered,
    they may be silent for that long. ``silence`` may be changed at any time.
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
        """Check once."""
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
