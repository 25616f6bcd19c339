# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Actions of the page: the stop, and the commands that it starts."""

import asyncio
import os
import subprocess
import tempfile
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Protocol

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_drivers.stop_channel import stop_all

_LINES = 12  # last lines of a command
_PULSES = "ok    limits"  # start of the line of a checklist that reveals the pulses
# Threads for the stop alone, which no other action uses, and threads that it waits for.
_STOPS, _CALLS = ThreadPoolExecutor(16, "stop"), ThreadPoolExecutor(16, "ask")


class ActionError(EntrainmentError):
    """An action of the page is impossible now, or there was no answer."""


class Nodes(Protocol):
    """What the page can request from the nodes; a bag offers none of it."""

    def ask(self, what: str, reason: str = "") -> str:
        """
        Stop or arm the robot; have the session pause, continue or repeat a block for a reason.

        ``what`` is one of stop, arm, pause, go_on and repeat. Returns the answer; raises
        ActionError if the request is refused or not answered.
        """

    def note(self, text: str) -> str:
        """Publish a note."""

    def offered(self) -> set[str]:
        """Return which of these requests are available."""


def stop(nodes: Nodes | None) -> list[str]:
    """
    Bring every robot of this machine to zero torque, as `entrain stop` does; return the answers.

    The robot shown may be elsewhere: if none is here, the answer is that to a request over ROS.
    """
    over_ros = _CALLS.submit(_ask_over_ros, nodes)
    answers = stop_all()
    lines = [f"{name}: {answer.message}" for name, answer in answers.items()]
    done = all(answer.done for answer in answers.values())
    if not answers:
        done, answer = over_ros.result()
        lines = [answer]
    return lines if done else [*lines, "not every robot confirmed the stop: cut the power"]


def _ask_over_ros(nodes: Nodes | None) -> tuple[bool, str]:
    if nodes is None or "stop" not in nodes.offered():
        return True, "no robot is driven by this machine"
    done, answer = attempted(partial(nodes.ask, "stop"))
    return done, f"asked over ROS: {answer}"


async def stop_at_once(nodes: Nodes | None) -> list[str]:
    """Stop as ``stop`` does, even while the web server waits for other actions."""
    return await asyncio.get_running_loop().run_in_executor(_STOPS, stop, nodes)


class Command:
    """
    The command that the page may start, or its checklist, one at a time.

    It is a separate process: a run outlives the page that started it. ``words`` are the arguments
    of `entrain` for a run or session; without any, there is nothing to start. ``heartbeat`` makes
    the page a heartbeat of the run.
    """

    def __init__(self, words: Sequence[str], *, heartbeat: bool = False) -> None:
        self.words = tuple(words)
        self._heartbeat = ("--heartbeat",) if heartbeat else ()
        self._process: subprocess.Popen[bytes] | None = None
        self._starting = threading.Lock()
        self._output = tempfile.TemporaryFile()  # noqa: SIM115, as long as the page
        self.name = ""

    @property
    def runs(self) -> bool:
        """Whether a command is running."""
        return self._process is not None and self._process.poll() is None

    def start(self, *, preflight: bool = False) -> str:
        """Start it, or its checklist; ActionError if either is running."""
        kind, *options = self.words
        words = [*self.words, *self._heartbeat]
        if preflight:
            session = ["--session"] if kind == "session" else []
            words = ["preflight", *session, *options]
        with self._starting:  # a double click arrives in two threads
            if self.runs:
                raise ActionError(f"entrain {self.name} is running: wait for its end, or stop it")
            self.name = words[0]
            self._output.seek(0)
            self._output.truncate()
            self._process = subprocess.Popen(
                ["entrain", *words],
                env={**os.environ, "PYTHONUNBUFFERED": "1"},  # each line as it is printed
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        return f"entrain {self.name} has started"

    def messages(self, *, outcome: bool = True) -> list[str]:
        """
        Return the last lines that the command printed, and how it ended.

        Without ``outcome``, nothing that reveals the condition: for a good run only how it ended.
        """
        if self._process is None:
            return []
        size = os.fstat(self._output.fileno()).st_size
        text = os.pread(self._output.fileno(), 8192, max(size - 8192, 0)).decode(errors="replace")
        lines = [line.rpartition("\r")[2] for line in text.splitlines()][-_LINES:]
        code = self._process.poll()
        if self.name == "run" and not (outcome or code):
            lines = []
        lines = [line for line in lines if outcome or not line.startswith(_PULSES)]
        if code is not None:
            lines.append(f"entrain {self.name} has ended with exit code {code}")
        return lines


def attempted(action: Callable[[], str]) -> tuple[bool, str]:
    """Try an action; return whether it was done, and the message to show."""
    try:
        return True, action()
    except EntrainmentError as error:
        return False, str(error)
