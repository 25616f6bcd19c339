# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The processes of a run: started together, watched, and stopped together, torque first.

Each process writes its own log. If one ends early or falls silent, the error names it and quotes
the end of its log; the others are stopped within five seconds.
"""

import os
import signal
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.process import BaseProcess
from pathlib import Path

from gait_entrainment_bringup.node_process import load, start_node
from gait_entrainment_commands.signals import undisturbed
from gait_entrainment_nodes.messaging.environment import PACKAGE, set_environment
from gait_entrainment_nodes.messaging.errors import NodeError

# How long a process may take to stop by itself [s]; all together take less than five seconds.
TIMEOUT = 1.5
# How long the recorder may take to close the bag after the experiment or replay has ended [s].
CLOSING_TIMEOUT = 15.0
LOG_LINES = 8
METHOD = "fork"  # of starting the nodes of a command


class Supervisor:
    """
    Runs one process per node, all in one environment; their logs go to a folder.

    ``method`` is how processes are started, see ``node_process``.
    """

    def __init__(
        self, folder: Path, environment: Mapping[str, str], method: str = "spawn"
    ) -> None:
        self.folder, self._method = folder, method
        self._environment = dict(environment)
        self._processes: dict[str, BaseProcess] = {}
        self._onlookers: set[str] = set()

    def start(self, node: str, arguments: Sequence[str], onlooker_of: str = "") -> None:
        """Start a node of the package, or an onlooker of another package, which may end."""
        module = f"{onlooker_of or f'{PACKAGE}.nodes'}.{node}"
        if onlooker_of:
            self._onlookers.add(node)
        self._processes[node] = start_node(
            self._method, module, arguments, self._log(node), self._environment
        )

    def ended(self) -> dict[str, int]:
        """Return the exit codes of the processes that have ended."""
        codes = {node: process.exitcode for node, process in self._processes.items()}
        return {node: code for node, code in codes.items() if code is not None}

    def check(self, may_end: Collection[str]) -> dict[str, int]:
        """Return ``ended``; NodeError if one has failed, or has ended without being allowed to."""
        ended = self.ended()
        for node, code in ended.items():
            if node in self._onlookers:
                continue
            if code != 0 or node not in may_end:
                raise NodeError(f"{node} ended unexpectedly with exit code {code}", node)
        return ended

    def wait(self, node: str, timeout: float) -> int | None:
        """Wait for a process to end by itself; return its exit code, or None after the timeout."""
        self._processes[node].join(timeout)
        return self._processes[node].exitcode

    def wait_for_record(self) -> None:
        """Wait until the recorder has closed the bag and ended; NodeError if it has not."""
        if self.wait("bag_recorder", CLOSING_TIMEOUT) != 0:
            raise NodeError("bag_recorder did not complete the record", "bag_recorder")

    def request_stop(self, nodes: Iterable[str]) -> None:
        """Send SIGTERM to processes without waiting for them to end."""
        for node in nodes:
            process = self._processes.get(node)
            if process is not None and process.is_alive():
                process.terminate()
                with suppress(ProcessLookupError):  # it may have ended by now
                    # A suspended process can only obey once it continues.
                    os.kill(process.pid or 0, signal.SIGCONT)

    def stop(self, order: Sequence[str]) -> list[str]:
        """
        Stop what is still running: SIGTERM in order, SIGKILL for what does not obey.

        The first one ends before the next ones are asked, which end in parallel; then the last
        one is asked. Returns the nodes that had to be killed. Another Ctrl-C in the meantime is
        ignored: it would leave a recorder writing a bag that this process considers abandoned.
        """
        ended = self.ended()
        running = [node for node in order if node in self._processes and node not in ended]
        killed = []
        with undisturbed():
            for group in (running[:1], running[1:-1], running[1:][-1:]):
                self.request_stop(group)
                deadline = time.monotonic() + TIMEOUT
                for node in group:
                    if self.wait(node, max(deadline - time.monotonic(), 0)) is None:
                        self._processes[node].kill()
                        self._processes[node].join()
                        killed.append(node)
        return killed

    def last_lines(self, node: str) -> str:
        """Return the end of a process's log."""
        log = self._log(node)
        lines = log.read_text(errors="replace").splitlines() if log.exists() else []
        return "\n".join(f"  {node}| {line}" for line in lines[-LOG_LINES:])

    def _log(self, node: str) -> Path:
        return self.folder / f"{node}.log"


@contextmanager
def supervised(
    domain: int,
    order: Sequence[str],
    remains: Callable[[], str] = lambda: "",
    *,
    real_time: bool = False,
) -> Iterator[Supervisor]:
    """
    Yield a supervisor of processes in a ROS domain, and stop them in order at the end.

    They are forked: start them before anything that starts a thread, such as a ROS client.
    A failure or an interruption becomes a NodeError with the reason, what ``remains`` returns
    once everything has stopped, and the end of the blamed node's log.
    """
    environment = set_environment(domain, real_time=real_time)
    load()
    with tempfile.TemporaryDirectory(prefix="entrain_") as folder:
        supervisor = Supervisor(Path(folder), environment, METHOD)
        try:
            try:
                yield supervisor
            finally:
                supervisor.stop(order)
        except KeyboardInterrupt:
            raise NodeError(f"interrupted{remains()}") from None
        except NodeError as error:
            lines = supervisor.last_lines(error.node)
            raise NodeError(f"{error}{remains()}" + (f"\n{lines}" if lines else "")) from None
