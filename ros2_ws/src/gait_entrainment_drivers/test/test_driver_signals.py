# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Whatever stops the kit in the middle of a pulse, the motor's torque ends with it."""

import signal
import subprocess
import sys

import pytest

from gait_entrainment_commands.signals import STOPPING

from .emulator_process import emulator, read_trace, until


@pytest.mark.parametrize("number", STOPPING, ids=lambda number: number.name)
def test_the_kit_that_is_stopped_leaves_no_torque(tmp_path, number):
    trace = tmp_path / "trace"
    with emulator(trace=trace) as driver:
        words = "-m", "gait_entrainment_commands", "driver", "prove", driver, "--arm"
        kit = subprocess.Popen(
            [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            # As a shell starts a job in the background.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
        )  # fmt: skip
        until(lambda: trace.exists() and read_trace(trace) and read_trace(trace)[-1][2] > 4.0)
        kit.send_signal(number)
        told, problems = kit.communicate(timeout=10)
        assert kit.returncode == 1
        assert "Traceback" not in told + problems
        until(lambda: abs(read_trace(trace)[-1][2]) < 0.1)
