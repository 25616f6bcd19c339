# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One node as a process with its own session, log, environment and name.

Loading ROS, numpy and the messages takes a node longer than anything else before a run. A process
that has no ROS context and only one thread may load them once and fork the nodes; otherwise nodes
are spawned, each with an interpreter that loads what it needs.
"""

import ctypes
import importlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from gait_entrainment_commands.signals import STOPPING
from gait_entrainment_nodes.messaging.environment import PACKAGE

_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
# Fields of /proc/self/stat with the addresses of the command line, counted after the name.
_ARGUMENTS = slice(45, 47)


def load() -> None:
    """Load what nodes need, before they are forked."""
    for node in ("gait_analyzer", "bag_recorder"):  # these load what all others need
        importlib.import_module(f"{PACKAGE}.nodes.{node}")


def start_node(
    method: str, module: str, arguments: Sequence[str], log: Path, environment: Mapping[str, str]
) -> BaseProcess:
    """
    Run a module's ``main`` with arguments in a process, started by ``method``: "fork" or "spawn".

    The new process gets SIGTERM if this one dies.
    """
    words = [module.rpartition(".")[2], *arguments]
    context: Any = multiprocessing.get_context(method)
    more = (os.getpid(), module, words, log, dict(environment))
    process: BaseProcess = context.Process(target=_run, args=more, daemon=True)
    # Signals that stop the child stay pending until it has set its own handlers.
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
    return process


def end_with(parent: int) -> bool:
    """Have this process get SIGTERM when its parent dies; return whether the parent is alive."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    return os.getppid() == parent  # else it died before the line above


def _run(
    parent: int, module: str, words: Sequence[str], log: Path, environment: Mapping[str, str]
) -> None:
    """Become the node."""
    # Ctrl-C reaches only the parent, which then stops the nodes in order.
    os.setsid()
    for number in STOPPING:  # the parent's handlers are not for a node
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPPING)
    if not end_with(parent):
        return
    with log.open("wb") as file:
        os.dup2(file.fileno(), sys.stdout.fileno())
        os.dup2(file.fileno(), sys.stderr.fileno())
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = list(words)
    ctypes.CDLL(None).prctl(_PR_SET_NAME, words[0].encode(), 0, 0, 0)
    # ps reads the command line from the process's own memory.
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = map(int, fields[_ARGUMENTS])
    shown = "\0".join(words).encode()[: end - start - 1]
    ctypes.memmove(start, shown.ljust(end - start, b"\0"), end - start)
    sys.exit(importlib.import_module(module).main())
