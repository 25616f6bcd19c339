# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Each test leaves the environment as it found it: commands that are run in process set theirs."""

import os
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def restored_environment() -> Iterator[None]:
    """Undo what a test has changed in the environment of those that follow."""
    before = dict(os.environ)
    yield
    os.environ.clear()
    os.environ.update(before)
