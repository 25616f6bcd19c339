# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One round of a node's loop: which errors it survives, and which it does not."""

from types import SimpleNamespace

import pytest
from builtin_interfaces.msg import Time as TimeMessage
from rclpy.time import Time

from gait_entrainment_nodes.nodes.loop import _serve_once

WARNINGS = []
NODE = SimpleNamespace(
    next_deadline=lambda: None,
    publish_state=lambda: None,
    late=(),
    get_logger=lambda: SimpleNamespace(warning=WARNINGS.append),
)


def executor_that_raises(error):
    def spin_once(timeout_sec):
        assert timeout_sec >= 0
        raise error

    return SimpleNamespace(spin_once=spin_once)


def test_an_answer_to_a_client_that_has_gone_does_not_end_the_node():
    gone = "failed to send response (timeout): client will not receive response"
    _serve_once(executor_that_raises(RuntimeError(gone)), NODE)


def test_a_clock_before_1970_is_reported_and_does_not_end_the_node():
    with pytest.raises(ValueError, match="negative") as refused:
        Time.from_msg(TimeMessage(sec=-5))  # as rclpy reads /clock
    _serve_once(executor_that_raises(refused.value), NODE)
    assert "/clock" in WARNINGS.pop()


@pytest.mark.parametrize("error", [RuntimeError("out of memory"), ValueError("no number")])
def test_any_other_error_ends_the_node(error):
    with pytest.raises(type(error)):
        _serve_once(executor_that_raises(error), NODE)
