# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the package offers at its top level, loaded only when it is asked for."""

import subprocess
import sys

import pytest

import gait_entrainment


def test_the_default_experiment_in_two_lines():
    protocol = gait_entrainment.read_protocol("baseline: 2\npulses: {count: 2}\nwashout: 0\n")
    strides = gait_entrainment.simulate(protocol).analysis.strides
    assert [stride.number for stride in strides[:4]] == [1, 2, 3, 4]


def test_nothing_is_loaded_before_it_is_asked_for():
    code = (
        "import gait_entrainment, sys; gait_entrainment.WalkerParameters;"
        "print(sorted({'numba', 'numpy', 'yaml'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="has no attribute walk"):
        gait_entrainment.walk  # noqa: B018
