# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Compute rows in processes on this machine, or on the workers of a Dask cluster.

Rows are yielded in the order in which they are finished.
"""

import asyncio
import importlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from gait_entrainment.settings import Setting
from gait_entrainment_studies.sweep.plan import SweepError, SweepPlan
from gait_entrainment_studies.sweep.row import Row, sweep_row

JOBS = Setting("processes; default: all cores", int, least=1, most=1000)
# A scheduler that does not answer within this time [s] is reported.
SCHEDULER_TIMEOUT = 6.0

Rows = Iterator[tuple[int, Row]]
Made = TypeVar("Made")


def chosen_jobs(text: str | None) -> int:
    """Return the given number of JOBS; by default, the number of cores of this process."""
    return len(os.sched_getaffinity(0)) if text is None else int(JOBS.parse("jobs", text))


def by_processes(
    make: Callable[[int], Made], indices: Sequence[int], jobs: int
) -> Iterator[tuple[int, Made]]:
    """Call `make` for each index in `jobs` processes, in any order; if 1, in this process."""
    if jobs == 1:
        for index in indices:
            yield index, make(index)
        return
    # A fork of this process has everything loaded and starts immediately, but a fork of a process
    # with threads may hang: such a process gets its workers from a fork server.
    alone = threading.active_count() == 1
    context = multiprocessing.get_context("fork" if alone else "forkserver")
    # Ctrl-C reaches every process in the terminal; only this one reacts to it.
    pool = ProcessPoolExecutor(
        jobs, context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    )
    try:
        futures = {pool.submit(make, index): index for index in indices}
        for future in as_completed(list(futures)):
            yield futures.pop(future), future.result()
    except BrokenProcessPool:
        raise SweepError(
            f"one of {jobs} processes was killed, perhaps because memory ran out: repeat the"
            " command, perhaps with fewer --jobs"
        ) from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def rows_by_dask(plan: SweepPlan, indices: Sequence[int], scheduler: str) -> Rows:
    """
    Compute rows on a Dask cluster.

    Raises SweepError if its scheduler does not answer or a row cannot be computed there.
    """
    try:
        dask: Any = importlib.import_module("distributed")  # optional, and slow to load
    except ImportError:
        raise SweepError("--scheduler needs Dask: pip install distributed") from None
    _ask_who_it_is(dask, scheduler)
    with dask.Client(scheduler, timeout=SCHEDULER_TIMEOUT) as client:
        futures = {client.submit(sweep_row, plan, index, pure=False): index for index in indices}
        try:
            for future in dask.as_completed(list(futures)):
                yield futures.pop(future), future.result()
        except Exception as error:  # whatever a worker raised, or the loss of the cluster
            what = f"{type(error).__name__}: {error}".partition("\n")[0]
            raise SweepError(
                f"scheduler {scheduler}: a row could not be computed ({what}): check that it runs,"
                " its workers with this version of gait_entrainment; the same command continues"
            ) from None


def _ask_who_it_is(dask: Any, scheduler: str) -> None:
    """Check that a scheduler answers: Dask's client waits forever for any other service."""

    async def kind() -> str:
        async with dask.rpc(scheduler) as remote:
            identity = await asyncio.wait_for(remote.identity(), SCHEDULER_TIMEOUT)
        return str(identity["type"])

    try:
        answer = asyncio.run(kind())
    except Exception as error:  # another service may answer anything
        raise SweepError(
            f"scheduler {scheduler} does not answer within {SCHEDULER_TIMEOUT:g} s"
            f" ({type(error).__name__}): start it, or leave out --scheduler"
        ) from None
    if answer != "Scheduler":
        raise SweepError(f"scheduler {scheduler} is a {answer}: give the scheduler's address")
