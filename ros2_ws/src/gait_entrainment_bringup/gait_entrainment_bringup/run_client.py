# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client of a run: asks the experiment to conduct a protocol, and shows its progress."""

from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from tqdm import tqdm

from gait_entrainment.protocol import Protocol, write_protocol
from gait_entrainment_bringup.node_list import RUN_CLIENT
from gait_entrainment_bringup.operator_console import Operator, keys_at_once
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_bringup.watch import Watch
from gait_entrainment_drivers.stop_channel import StopAnswer, StopListener
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.environment import come_before_others
from gait_entrainment_nodes.messaging.errors import NodeError
from gait_entrainment_nodes.messaging.topics import PULSE_PHASES, STRIDES

ACTION = "experiment/run_protocol"
# How long the experiment may take to appear [s].
APPEARANCE_TIMEOUT = 30.0
# Nodes that nothing in the chain of promises waits for, so they are asked for a sign of life, and
# how long they may owe it [s]. The experiment watches the others.
ASKED = ("experiment", "gait_analyzer")
SILENCE_TIMEOUT = 3.0


def conduct(
    supervisor: Supervisor,
    protocol: Protocol,
    on_start: Callable[[], None],
    *,
    quiet: bool,
    real_time: bool,
    silence: float,
    early: StopListener,
) -> None:
    """
    Conduct a protocol through the experiment node to its end, and watch the processes meanwhile.

    ``on_start`` is called once the experiment has accepted it. In ``real_time`` this process is
    scheduled before others. During the run, nodes that no other node watches may be silent for
    ``silence`` [s]; until it has started, ``early`` hears a stop. NodeError if the run fails.
    """
    bar = tqdm(total=protocol.strides, unit="stride", disable=True if quiet else None, leave=False)
    with bar, keys_at_once(), Client(RUN_CLIENT) as client:
        latest: dict[str, str] = {}

        def show(**values: str) -> None:
            latest.update(values)
            bar.set_postfix_str(" ".join(latest.values()), refresh=False)

        def on_feedback(message: Any) -> None:
            early.close()
            watch.silence = silence
            bar.update(message.feedback.state.stride - bar.n)

        client.subscribe(STRIDES, lambda s: show(stride=f"period {s.period:.4f} s"))
        client.subscribe(PULSE_PHASES, lambda p: show(pulse=f"lag {p.phase_lag * 1e3:+.0f} ms"))
        client.action(RunProtocol, ACTION)
        # The recorder ends by itself once the record is complete.
        watch = Watch(client, supervisor, may_end=("bag_recorder",), asked=ASKED, silence=silence)
        # Before the walk starts there is no torque, and much is still being loaded.
        watch.silence = max(silence, SILENCE_TIMEOUT)
        operator = Operator(client)

        def look() -> None:
            watch()
            operator()
            if early.fileno() >= 0 and (askers := early.requests()):
                early.answer(askers, StopAnswer(True, "the run ends"))
                raise NodeError("the stop was called", "")

        client.each_round = look
        if real_time:
            come_before_others()
        client.wait_to_be_known("experiment", APPEARANCE_TIMEOUT)
        goal = RunProtocol.Goal(protocol=write_protocol(protocol))
        handle = client.send_goal(RunProtocol, ACTION, goal, on_feedback=on_feedback)
        if not handle.accepted:
            raise NodeError("experiment rejected the protocol: it runs another one", "experiment")
        on_start()
        answer = client.result(handle)
    if answer.status != GoalStatus.STATUS_SUCCEEDED:
        raise NodeError(answer.result.message or "experiment failed", answer.result.blamed)
