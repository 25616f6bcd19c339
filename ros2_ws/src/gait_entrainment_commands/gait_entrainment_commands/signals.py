# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Signals that stop what drives a robot: whatever a terminal, a shell or a system sends."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

# Ctrl-C, kill, a closed terminal, Ctrl-Z and Ctrl-\. A suspended run would go on pushing with
# nobody to stop it, so Ctrl-Z stops it too.
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT)


def stop_on_signals() -> None:
    """
    Raise KeyboardInterrupt at any of them.

    Also at SIGINT, which a shell has its background jobs ignore.
    """
    for number in STOPPING:
        signal.signal(number, signal.default_int_handler)


def end_once() -> None:
    """
    Raise KeyboardInterrupt at the first of them alone.

    For a process that gets it both from a terminal and from its parent: the second must not break
    into the end that the first began.
    """

    def interrupt(_number: int, _frame: object) -> None:
        for number in STOPPING:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in STOPPING:
        signal.signal(number, interrupt)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Let none of them break in: for what is about to end."""
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in STOPPING}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
