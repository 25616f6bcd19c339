# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One round of the loop of a node: what it survives, and what it does not."""

from types import SimpleNamespace

import pytest

from gait_entrainment_nodes.nodes.loop import _serve_once

NODE = SimpleNamespace(next_deadline=lambda: None, publish_state=lambda: None, late=())


def executor_that_raises(text):
    def spin_once(timeout_sec):
        assert timeout_sec >= 0
        raise RuntimeError(text)

    return SimpleNamespace(spin_once=spin_once)


def test_an_answer_that_nobody_waits_for_any_more_ends_no_node():
    gone = "failed to send response (timeout): client will not receive response"
    _serve_once(executor_that_raises(gone), NODE)


def test_any_other_error_does():
    with pytest.raises(RuntimeError, match="out of memory"):
        _serve_once(executor_that_raises("out of memory"), NODE)
