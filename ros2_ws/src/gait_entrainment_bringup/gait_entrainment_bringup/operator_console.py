# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The operator of a run: a sign of life for the robot, and a key that stops it."""

import os
import select
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

from gait_entrainment_bringup.node_list import RUN_CLIENT
from gait_entrainment_drivers.stop_channel import stop_all
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.errors import NodeError
from gait_entrainment_nodes.messaging.topics import OPERATOR_HEARTBEAT

STOP_KEY = " "


class Operator:
    """Called in each round of a client: shows that someone watches, and checks the keyboard."""

    def __init__(self, client: Client) -> None:
        self._heartbeat = client.node.create_publisher(
            OPERATOR_HEARTBEAT.type, OPERATOR_HEARTBEAT.name, OPERATOR_HEARTBEAT.qos
        )

    def __call__(self) -> None:
        """Publish the heartbeat; raise NodeError if the stop key was pressed."""
        self._heartbeat.publish(OPERATOR_HEARTBEAT.type(data=RUN_CLIENT))
        if pressed_key() == STOP_KEY:
            answers = [f"{name}: {answer.message}" for name, answer in stop_all().items()]
            raise NodeError("stopped by the space bar: " + "; ".join(answers), "")


@contextmanager
def keys_at_once() -> Iterator[None]:
    """Have a terminal pass on each key as it is pressed, without echoing it."""
    if not _is_attended():
        yield
        return
    before = termios.tcgetattr(0)
    tty.setcbreak(0)  # Ctrl-C and Ctrl-Z stay signals
    try:
        yield
    finally:
        if _is_attended():
            termios.tcsetattr(0, termios.TCSADRAIN, before)


def pressed_key() -> str:
    """Return a key that was pressed, or an empty string."""
    if not _is_attended() or not select.select([0], [], [], 0)[0]:
        return ""
    return os.read(0, 1).decode(errors="replace")


def _is_attended() -> bool:
    """Whether keys arrive here: a background job that touches its terminal is suspended."""
    try:
        return os.isatty(0) and os.tcgetpgrp(0) == os.getpgrp()
    except OSError:  # it is not the controlling terminal
        return True
