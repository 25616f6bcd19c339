# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import json
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from functools import partial
from threading import Thread

import numpy as np
import pytest

from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment_commands import main
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.walked import Outcome, walk_under_pulses
from gait_entrainment_studies.sweep import engine
from gait_entrainment_studies.sweep.engine import by_processes, rows_by_dask
from gait_entrainment_studies.sweep.plan import Axis, SweepError, SweepPlan
from gait_entrainment_studies.sweep.row import exact_borders, sweep_row
from gait_entrainment_studies.sweep.store import SweepStore, read_sweep

TABLE_1 = WalkerParameters()


def plan_of(**changes):
    values = {
        "walker": TABLE_1,
        "period_offsets": Axis(-0.09, 0.03, 7),
        "torque_fractions": Axis(0.05, 0.15, 3),
        "phases": 4,
        "strides": 120,
        "width": 0.1,
    }
    return SweepPlan(**{**values, **changes})


def same(left, right):
    assert left.keys() == right.keys()
    for name in left:
        np.testing.assert_array_equal(left[name], right[name])


def test_a_cell_summarizes_its_walks():
    row = sweep_row(plan_of(), 1)
    period = 1.9332295304390836 - 0.05
    gait = PulsedGait(TABLE_1, row["torque"][2], 0.1)
    walks = [walk_under_pulses(gait, period, phase, 120) for phase in (0.0, 0.25, 0.5, 0.75)]
    locked = [walk.outcome() is Outcome.LOCKED for walk in walks]
    assert row["period_offset"][2] == pytest.approx(-0.05)
    assert row["share_locked"][2] == np.mean(locked) == 1.0
    assert row["stable_locks"][2] == 1
    assert row["median_lag"][2] == pytest.approx(-0.056994, abs=1e-6)


def test_solved_and_walked_maps_agree_where_no_walk_is_censored():
    plan = plan_of(period_offsets=Axis(-0.085, 0.035, 9), strides=300)
    compared = 0
    for index in range(3):
        row = sweep_row(plan, index)
        for i in np.flatnonzero(row["share_censored"] == 0):
            assert (row["stable_locks"][i] > 0) == (row["share_locked"][i] > 0)
            compared += 1
    assert compared > 20


def test_cells_outside_the_models_domain_are_reported_one_by_one():
    plan = plan_of(
        period_offsets=Axis(-1.9, 0.1, 5), torque_fractions=Axis(-0.9, 0.9, 2), strides=20
    )
    slow, fast = sweep_row(plan, 0), sweep_row(plan, 1)
    assert slow["problem"][0] == fast["problem"][0] == "pulses overlap"
    assert np.isnan(slow["share_fell"][0])
    assert slow["share_fell"][1:].max() > 0
    assert fast["share_flew_off"][1:].max() > 0


def test_the_unperturbed_period_itself_is_reported_as_a_problem():
    row = sweep_row(plan_of(period_offsets=Axis(-0.05, 0.05, 3)), 0)
    assert row["problem"][1].startswith("the stride period itself")


def test_borders_are_missing_at_zero_torque_and_grow_with_torque():
    borders = exact_borders(TABLE_1, np.array([0.0, 0.1, 0.2]), 0.1)
    late = [b for b in borders if b.place == "pulse outlasts double stance"]
    assert [border.torque_fraction for border in late] == [0.1, 0.2]
    assert late[0].shortest == pytest.approx(-0.0793496, abs=1e-7)
    assert late[1].shortest < late[0].shortest


def test_two_processes_compute_the_same_rows_as_one():
    plan = plan_of()
    alone = dict(by_processes(partial(sweep_row, plan), range(3), 1))
    together = dict(by_processes(partial(sweep_row, plan), range(3), 2))
    for index in range(3):
        same(alone[index], together[index])


def test_a_killed_process_is_reported():
    plan = plan_of(torque_fractions=Axis(0.05, 0.15, 60))
    rows = by_processes(partial(sweep_row, plan), range(60), 2)
    next(rows)
    for process in multiprocessing.active_children():
        process.kill()
    with pytest.raises(SweepError, match="one of 2 processes was killed"):
        list(rows)


def test_dask_computes_the_same_rows_on_a_cluster_of_two_workers():
    distributed = pytest.importorskip("distributed")
    plan = plan_of()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        made = dict(rows_by_dask(plan, range(3), cluster.scheduler_address))
        worker = cluster.workers[0].worker_address
        with pytest.raises(SweepError, match="is a Worker: give the scheduler's address"):
            next(rows_by_dask(plan, range(3), worker))
    for index in range(3):
        same(made[index], sweep_row(plan, index))


def test_rows_that_a_cluster_cannot_compute_are_reported():
    distributed = pytest.importorskip("distributed")
    plan = plan_of(torque_fractions=Axis(0.05, 0.15, 60), strides=400)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        rows = rows_by_dask(plan, range(60), cluster.scheduler_address)
        next(rows)
        cluster.close()
        message = r"a row could not be computed.*the same command continues"
        with pytest.raises(SweepError, match=message):
            list(rows)


@pytest.mark.parametrize("service", ["none", "silent", "another"])
def test_a_scheduler_that_does_not_answer_is_named(service, tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    assert engine.SCHEDULER_TIMEOUT < 10
    monkeypatch.setattr(engine, "SCHEDULER_TIMEOUT", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        if service == "another":
            Thread(target=lambda: server.accept()[0].sendall(b"HTTP/1.0 400 Bad request")).start()
        elif service == "none":
            server.close()
        address = f"tcp://127.0.0.1:{port}"
        assert main(["sweep", "--out", str(tmp_path / "s"), "--scheduler", address]) == 1
    assert f"scheduler {address} does not answer" in capsys.readouterr().err


def test_a_sweep_is_resumed_only_with_its_own_plan(tmp_path):
    plan = plan_of()
    store = SweepStore(tmp_path, plan)
    SweepStore(tmp_path, plan_of(strides=98))  # no row was computed with the first plan
    store = SweepStore(tmp_path, plan)
    store.add(1, sweep_row(plan, 1))
    assert SweepStore(tmp_path, plan).missing() == [0, 2]
    with pytest.raises(UsageError, match=r"plan\.strides 120, not 99: resume it with that"):
        SweepStore(tmp_path, plan_of(strides=99))


@pytest.mark.parametrize("size", [0, 100])
def test_a_damaged_row_is_computed_again(size, tmp_path):
    plan = plan_of()
    store = SweepStore(tmp_path, plan)
    for index in range(3):
        store.add(index, sweep_row(plan, index))
    os.truncate(tmp_path / "parts" / "000001.parquet", size)
    assert store.missing() == [1]


def test_the_table_carries_plan_and_versions(tmp_path):
    plan = plan_of()
    store = SweepStore(tmp_path, plan)
    for index in (2, 0, 1):
        store.add(index, sweep_row(plan, index))
    table, description = read_sweep(store.finish())
    assert description["plan"]["walker"]["ankle_stiffness"] == 87.3
    assert set(description["versions"]) >= {"python", "numpy", "gait_entrainment"}
    fractions = np.asarray(table["torque_fraction"])
    np.testing.assert_allclose(fractions, np.repeat([0.05, 0.1, 0.15], 7))


OPTIONS = ["--torque-fractions", "0.02", "0.2", "12", "--period-offsets", "-0.1", "0.01", "12"]


def test_an_interrupted_sweep_continues_where_it_stopped(tmp_path, capsys):
    out = tmp_path / "sweep"
    command = [
        sys.executable,
        "-c",
        "import sys; from gait_entrainment_commands import main; sys.exit(main())",
        *("sweep", "--out", str(out), "--strides", "200", "--jobs", "1", *OPTIONS),
    ]
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        env=dict(os.environ),
        # A shell starts its background jobs, perhaps this test, with the interrupt ignored.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )
    parts = out / "parts"
    # Until the first parts are there; a sweep that writes none ends by itself and fails below.
    while process.poll() is None and not (parts.exists() and len(list(parts.iterdir())) > 2):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate()
    assert process.returncode == 1
    assert b"the same command continues" in error
    kept = {path: path.stat().st_mtime_ns for path in parts.glob("*.parquet")}
    assert 0 < len(kept) < 12
    assert main([*command[3:], "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["cells"] == 144
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in kept.items())
    assert (out / "tongue.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--torque-fractions", "0.2", "0.1", "3"], "torque_fractions: 0.2 to 0.1"),
        (["--period-offsets", "-0.1", "0", "0"], "period_offsets: '0'; allowed: a whole"),
        (["--period-offsets", "-0.1", "0", "2.5"], "period_offsets: '2.5'; allowed: a whole"),
        (["--torque-fractions", "0", "0.1", "nan"], "torque_fractions: 'nan'; allowed: a whole"),
        (["--width", "1.2"], "width: 1.2 s; allowed: above 0 and below a step"),
        (["--jobs", "-1"], "jobs: '-1'; allowed: a whole number from 1 to 1000"),
        (["--phases", "0"], "phases: '0'; allowed: a whole number"),
        (["--ankle-stiffness", "200"], "the walker flies off"),
    ],
)
def test_wrong_usage_is_reported(arguments, message, tmp_path, capsys):
    assert main(["sweep", "--out", str(tmp_path / "s"), *arguments]) == 2
    assert message in capsys.readouterr().err
