# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Signals that stop a process that drives a robot: from a terminal, a shell or the system."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

# Ctrl-C, kill, a closed terminal, Ctrl-Z and Ctrl-\. A suspended run would keep pushing with
# nothing to stop it, so Ctrl-Z stops it too.
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT)


def stop_on_signals() -> None:
    """
    Raise KeyboardInterrupt at any of them.

    This includes SIGINT, which a shell makes its background jobs ignore.
    """
    for number in STOPPING:
        signal.signal(number, signal.default_int_handler)


def end_once() -> None:
    """
    Raise KeyboardInterrupt only at the first of them.

    For a process that gets one from a terminal and one from its parent: the second must not
    interrupt the shutdown that the first started.
    """

    def interrupt(_number: int, _frame: object) -> None:
        for number in STOPPING:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in STOPPING:
        signal.signal(number, interrupt)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore all of them, for work that is about to end."""
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in STOPPING}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
