# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The processes of a run: started together, watched, and stopped together, torque first.

Each process writes to a log of its own. A process that ends before its time is named with the
last lines of its log; the others are stopped within five seconds.
"""

import ctypes
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from gait_entrainment_nodes.messaging.environment import PACKAGE

# A process has this long to stop by itself [s]; all together have less than five seconds.
PATIENCE = 1.5
LOG_LINES = 8
_PR_SET_PDEATHSIG = 1


class Supervisor:
    """Runs one process per node, all in one environment; their logs go to a folder."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._folder = folder
        self._environment = dict(environment)
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._library = ctypes.CDLL(None)

    def start(self, node: str, arguments: Sequence[str]) -> None:
        """Start a node of the package; it gets SIGTERM should this process die."""
        program = Path(get_package_prefix(PACKAGE)) / "lib" / PACKAGE / node
        with self._log(node).open("wb") as log:
            self._processes[node] = subprocess.Popen(
                [str(program), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                # Ctrl-C reaches this process alone, which then stops the others in order.
                start_new_session=True,
                preexec_fn=self._die_with_parent,
            )

    def ended(self) -> dict[str, int]:
        """Return the exit codes of the processes that have ended."""
        codes = {node: process.poll() for node, process in self._processes.items()}
        return {node: code for node, code in codes.items() if code is not None}

    def wait(self, node: str, timeout: float) -> int | None:
        """Wait for a process to end by itself; return its exit code, or None after the timeout."""
        try:
            return self._processes[node].wait(timeout)
        except subprocess.TimeoutExpired:
            return None

    def stop(self, order: Sequence[str]) -> list[str]:
        """
        Stop what still runs: SIGTERM in order, SIGKILL for what does not obey.

        The first in order has ended before the next is asked; the rest end side by side. Returns
        the nodes that had to be killed. Another Ctrl-C meanwhile changes nothing: it would leave
        a recorder at work on a bag that this process takes for given up.
        """
        with _undisturbed():
            return self._stop(order)

    def _stop(self, order: Sequence[str]) -> list[str]:
        running = [node for node in order if node in self._processes]
        running = [node for node in running if self._processes[node].poll() is None]
        killed = []
        for group in (running[:1], running[1:-1], running[-1:] if running[1:] else []):
            for node in group:
                self._processes[node].terminate()
                # Who was suspended can only obey once it goes on.
                self._processes[node].send_signal(signal.SIGCONT)
            deadline = time.monotonic() + PATIENCE
            for node in group:
                if self.wait(node, max(deadline - time.monotonic(), 0)) is None:
                    self._processes[node].send_signal(signal.SIGKILL)
                    self._processes[node].wait()
                    killed.append(node)
        return killed

    def last_lines(self, node: str) -> str:
        """Return the end of a process's log."""
        try:
            lines = self._log(node).read_text(errors="replace").splitlines()
        except OSError:
            return ""
        return "\n".join(f"  {node}| {line}" for line in lines[-LOG_LINES:])

    def _log(self, node: str) -> Path:
        return self._folder / f"{node}.log"

    def _die_with_parent(self) -> None:
        self._library.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        if os.getppid() == 1:  # the parent died before the line above
            os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let neither SIGINT nor SIGTERM break in: for what has an end that is near."""
    handlers = {n: signal.signal(n, signal.SIG_IGN) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
