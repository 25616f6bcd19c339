# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Whatever signal stops the kit in the middle of a pulse, the motor's torque ends."""

import signal
import subprocess
import sys

import pytest

from gait_entrainment_commands.signals import STOPPING

from .emulator_process import emulator, read_trace, until


@pytest.mark.parametrize("number", STOPPING, ids=lambda number: number.name)
def test_a_stopped_kit_leaves_no_torque(tmp_path, number):
    trace = tmp_path / "trace"
    with emulator(trace=trace) as driver:
        options = "-m", "gait_entrainment_commands", "driver", "prove", driver, "--arm"
        kit = subprocess.Popen(
            [sys.executable, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            # As in a shell's background job.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
        )  # fmt: skip
        until(lambda: trace.exists() and read_trace(trace) and read_trace(trace)[-1][2] > 4.0)
        kit.send_signal(number)
        out, err = kit.communicate(timeout=10)
        assert kit.returncode == 1
        assert "Traceback" not in out + err
        until(lambda: abs(read_trace(trace)[-1][2]) < 0.1)
