# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The package's top-level names, which are loaded only when used."""

import subprocess
import sys

import pytest

import gait_entrainment


def test_the_default_experiment_in_two_lines():
    protocol = gait_entrainment.read_protocol("baseline: 2\npulses: {count: 2}\nwashout: 0\n")
    strides = gait_entrainment.simulate(protocol).analysis.strides
    assert [stride.number for stride in strides[:4]] == [1, 2, 3, 4]


def test_nothing_is_loaded_before_it_is_used():
    code = (
        "import gait_entrainment, sys; gait_entrainment.WalkerParameters;"
        "print(sorted({'numba', 'numpy', 'yaml'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="has no attribute walk"):
        gait_entrainment.walk  # noqa: B018
