# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What is done from the page: the stop, and the commands that it starts."""

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

_TOLD = 12  # last lines of a command
_PULSES = "ok    limits"  # how the line of a checklist begins that tells the pulses
# Threads of the stop alone, which no other action takes, and those that it waits for.
_STOPS, _ASKED = ThreadPoolExecutor(16, "stop"), ThreadPoolExecutor(16, "ask")


class ActionError(EntrainmentError):
    """An action from the page that cannot be done now, or nobody answered."""


class Nodes(Protocol):
    """What the page asks of the nodes; a bag offers none of it."""

    def ask(self, what: str, reason: str = "") -> str:
        """
        Stop or arm the robot; have the session pause, go on or repeat a block for a reason.

        ``what`` is one of stop, arm, pause, go_on and repeat. Returns the answer; raises
        ActionError for a refusal, or if nobody answers.
        """

    def note(self, text: str) -> str:
        """Publish a note."""

    def offered(self) -> set[str]:
        """Return what of all that somebody answers."""


def stop(nodes: Nodes | None) -> list[str]:
    """
    Bring every robot of this machine to zero torque, as `entrain stop` does; return the answers.

    The one that is shown may be elsewhere: asked over ROS, too, it answers if there is none here.
    """
    asked = _ASKED.submit(_ask_over_ros, nodes)
    answers = stop_all()
    lines = [f"{name}: {answer.message}" for name, answer in answers.items()]
    done = all(answer.done for answer in answers.values())
    if not answers:
        done, answer = asked.result()
        lines = [answer]
    return lines if done else [*lines, "not everybody confirmed the stop: cut the power"]


def _ask_over_ros(nodes: Nodes | None) -> tuple[bool, str]:
    if nodes is None or "stop" not in nodes.offered():
        return True, "no robot is driven by this machine"
    done, answer = attempted(partial(nodes.ask, "stop"))
    return done, f"asked over ROS: {answer}"


async def stop_at_once(nodes: Nodes | None) -> list[str]:
    """Stop as ``stop`` does, whatever else the web server waits for."""
    return await asyncio.get_running_loop().run_in_executor(_STOPS, stop, nodes)


class Command:
    """
    What the page may start, or the checklist before it, one at a time.

    It is a process of its own: a run outlives the page that started it. ``words`` are those of
    `entrain run` or `entrain session`; without any, there is nothing to start. A run of which the
    page is a ``heartbeat`` is told so.
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
        """Whether a command goes on."""
        return self._process is not None and self._process.poll() is None

    def start(self, *, preflight: bool = False) -> str:
        """Start it, or its checklist; ActionError if one of them goes on."""
        kind, *options = self.words
        words = [*self.words, *self._heartbeat]
        if preflight:
            session = ["--session"] if kind == "session" else []
            words = ["preflight", *session, *options]
        with self._starting:  # a double click comes in two threads
            if self.runs:
                raise ActionError(f"entrain {self.name} goes on: wait for its end, or stop it")
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

    def told(self, *, outcome: bool = True) -> list[str]:
        """
        Return the last lines that the command has printed, and how it ended.

        Without ``outcome`` nothing that tells the condition: of a run that ended well the latter.
        """
        if self._process is None:
            return []
        size = os.fstat(self._output.fileno()).st_size
        text = os.pread(self._output.fileno(), 8192, max(size - 8192, 0)).decode(errors="replace")
        lines = [line.rpartition("\r")[2] for line in text.splitlines()][-_TOLD:]
        code = self._process.poll()
        if self.name == "run" and not (outcome or code):
            lines = []
        lines = [line for line in lines if outcome or not line.startswith(_PULSES)]
        if code is not None:
            lines.append(f"entrain {self.name} has ended with exit code {code}")
        return lines


def attempted(action: Callable[[], str]) -> tuple[bool, str]:
    """Do an action; return whether it was done, and what to tell."""
    try:
        return True, action()
    except EntrainmentError as error:
        return False, str(error)
