# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What is done from the page: the stop, and the commands that it starts."""

import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_drivers.stop_channel import stop_all

_TOLD = 12  # last lines of a command


@dataclass(frozen=True)
class Stopped:
    """What came of a stop: whether everybody confirmed it, and what each robot answered."""

    done: bool
    lines: tuple[str, ...]


class ActionError(EntrainmentError):
    """An action from the page that cannot be done now, or nobody answered."""


class Robot(Protocol):
    """What the page asks of the nodes; a bag offers none of it."""

    def stop(self) -> str:
        """Stop a robot that another machine drives, over ROS; return the answer."""

    def arm(self) -> str:
        """Arm the robot; return the answer."""

    def note(self, text: str) -> str:
        """Publish a note."""

    def pause(self, *, paused: bool) -> str:
        """Have the session wait before its next block, or go on."""

    def repeat(self) -> str:
        """Have the session walk its last block again."""

    def offered(self) -> set[str]:
        """Return which of stop, arm, pause and repeat somebody answers."""


def stop(robot: Robot | None = None) -> Stopped:
    """
    Bring every robot of this machine to zero torque, as `entrain stop` does.

    If this machine drives none, the ``robot`` of another one is asked over ROS.
    """
    answers = stop_all()
    lines = [f"{name}: {a.message if a else 'no answer'}" for name, a in answers.items()]
    done = bool(answers) and all(answer and answer.done for answer in answers.values())
    if not answers:
        if robot is None or "stop" not in robot.offered():
            return Stopped(False, ("no robot is driven by this machine",))
        done, answer = attempted(robot.stop)
        lines = [f"asked over ROS: {answer}"]
    if not done:
        lines.append("not everybody confirmed the stop: cut the power")
    return Stopped(done, tuple(lines))


class Command:
    """
    ``entrain run`` or ``entrain preflight`` with the options of the page, one at a time.

    It is a process of its own: a run outlives the page that started it. ``words`` are the options;
    without any, there is nothing to start. A run of which the page is a ``heartbeat`` is told so.
    """

    def __init__(self, words: Sequence[str], *, heartbeat: bool = False) -> None:
        self.words = tuple(words)
        self._of_run = ("--heartbeat",) if heartbeat else ()
        self._process: subprocess.Popen[bytes] | None = None
        self._output = tempfile.TemporaryFile()  # noqa: SIM115, as long as the page
        self.name = ""

    @property
    def runs(self) -> bool:
        """Whether a command goes on."""
        return self._process is not None and self._process.poll() is None

    def start(self, name: str) -> str:
        """Start a command; ActionError if one goes on, or nothing was given to start."""
        if not self.words:
            raise ActionError("nothing to start: open the page with entrain page PROTOCOL.yaml")
        if self.runs:
            raise ActionError(f"entrain {self.name} goes on: wait for its end, or stop it")
        self.name = name
        self._output.seek(0)
        self._output.truncate()
        self._process = subprocess.Popen(
            ["entrain", name, *self.words, *(self._of_run if name == "run" else ())],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        return f"entrain {name} has started"

    def told(self) -> list[str]:
        """Return the last lines that the command has printed, and how it ended."""
        if self._process is None:
            return []
        size = os.fstat(self._output.fileno()).st_size
        text = os.pread(self._output.fileno(), 8192, max(size - 8192, 0)).decode(errors="replace")
        lines = [line.rpartition("\r")[2] for line in text.splitlines()][-_TOLD:]
        code = self._process.poll()
        if code is not None:
            lines.append(f"entrain {self.name} has ended with exit code {code}")
        return lines


def attempted(action: Callable[[], str]) -> tuple[bool, str]:
    """Do an action; return whether it was done, and what to tell."""
    try:
        return True, action()
    except EntrainmentError as error:
        return False, str(error)
