# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What holds for every test.

Each leaves the environment as it found it: commands that are run in process set theirs. Properties
are tried with the same examples each time, for as long as it takes: a computer may be busy.
"""

import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "repeatable",
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("repeatable")


@pytest.fixture(autouse=True)
def restored_environment() -> Iterator[None]:
    """Undo what a test has changed in the environment of those that follow."""
    before = dict(os.environ)
    yield
    os.environ.clear()
    os.environ.update(before)
