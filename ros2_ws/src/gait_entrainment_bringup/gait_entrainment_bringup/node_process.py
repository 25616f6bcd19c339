# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One node as a process, forked from a server that has loaded what all nodes need.

To load ROS, numpy and the messages takes a node longer than anything else before a run. The server
(multiprocessing's forkserver) does so once, with one thread and no ROS context, so that it can be
forked safely; each node becomes a process with a session, a log, an environment and a name of its
own.
"""

import ctypes
import importlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import forkserver
from multiprocessing.process import BaseProcess
from pathlib import Path

from gait_entrainment_nodes.messaging.environment import PACKAGE

# These load what the others need as well.
_PRELOADED = [f"{PACKAGE}.nodes.{node}" for node in ("gait_analyzer", "bag_recorder")]
_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
# Where in /proc/self/stat the addresses of the command line are, counted behind the name.
_ARGUMENTS = slice(45, 47)


def prepare() -> None:
    """Start the server, which loads what the nodes need; returns at once."""
    forkserver.set_forkserver_preload(_PRELOADED)
    forkserver.ensure_running()


def start_node(
    module: str, arguments: Sequence[str], log: Path, environment: Mapping[str, str]
) -> BaseProcess:
    """Run ``main`` of a module with arguments; it gets SIGTERM if this process dies."""
    prepare()
    words = [module.rpartition(".")[2], *arguments]
    process = multiprocessing.get_context("forkserver").Process(
        target=_run, args=(module, words, log, dict(environment)), daemon=True
    )
    process.start()
    return process


def _run(module: str, words: Sequence[str], log: Path, environment: Mapping[str, str]) -> None:
    """Become the node."""
    # Ctrl-C reaches the process that supervises alone, which then stops the nodes in order.
    os.setsid()
    library = ctypes.CDLL(None)
    library.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if os.getppid() == 1:  # the server died before the line above
        return
    with log.open("wb") as file:
        os.dup2(file.fileno(), sys.stdout.fileno())
        os.dup2(file.fileno(), sys.stderr.fileno())
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = list(words)
    library.prctl(_PR_SET_NAME, words[0].encode(), 0, 0, 0)
    # What ps shows of the command line lies in memory that is the process's own.
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = map(int, fields[_ARGUMENTS])
    shown = "\0".join(words).encode()[: end - start - 1]
    ctypes.memmove(start, shown.ljust(end - start, b"\0"), end - start)
    sys.exit(importlib.import_module(module).main())
