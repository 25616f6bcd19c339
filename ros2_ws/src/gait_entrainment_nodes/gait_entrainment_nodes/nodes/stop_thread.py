# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The perturbator's end of the stop channel: a thread that no executor can block."""

import select
import threading
from collections.abc import Callable

from gait_entrainment_drivers.stop_channel import StopAnswer, StopListener

# How often the thread checks whether to end [s].
_PERIOD = 0.2


class StopThread:
    """
    Calls ``stop`` at every request, and answers with what that returns.

    ``stop`` is called from this thread. A robot that is driven by a torque loop listens by itself
    (torque_loop.py) and reports what it measures; this thread answers for the node.
    """

    def __init__(self, name: str, stop: Callable[[], StopAnswer]) -> None:
        self._listener, self._stop = StopListener(name), stop
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="stop channel", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._ending.set()
        self._thread.join()
        self._listener.close()

    def _listen(self) -> None:
        while not self._ending.is_set():
            if select.select([self._listener], [], [], _PERIOD)[0]:
                requests = self._listener.requests()
                self._listener.answer(requests, self._stop())
