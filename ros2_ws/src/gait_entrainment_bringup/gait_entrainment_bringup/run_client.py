# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The client of a run: asks the experiment to conduct a protocol, and shows how it goes."""

import time
from functools import partial
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from tqdm import tqdm

from gait_entrainment.protocol import Protocol
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_msgs.msg import ExperimentState, PulsePhase, Stride
from gait_entrainment_msgs.srv import Ready
from gait_entrainment_nodes.messaging.topics import PULSE_PHASES, STRIDES

# How long the experiment may take to appear [s].
APPEARANCE_TIMEOUT = 30.0
# Nodes for whom nothing in the chain of promises waits, and who therefore are asked for a sign of
# life: how often, and how long they may owe it [s]. The experiment watches the others.
ASKED = ("experiment", "gait_analyzer")
ASKING_PERIOD = 0.5
SILENCE_TIMEOUT = 3.0
# A pause between two looks that is so long [s] says that this process was held up itself.
HELD_UP = 1.0


class RunClient:
    """Conducts one protocol through the experiment node, and watches the processes meanwhile."""

    def __init__(self, supervisor: Supervisor, protocol: Protocol, quiet: bool) -> None:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self._supervisor = supervisor
        self._node = Node("entrain_run")
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._client = ActionClient(self._node, RunProtocol, "experiment/run_protocol")
        for topic, callback in ((STRIDES, self._on_stride), (PULSE_PHASES, self._on_pulse)):
            self._node.create_subscription(topic.type, topic.name, callback, topic.qos)
        self._bar = tqdm(
            total=protocol.strides, unit="stride", disable=True if quiet else None, leave=False
        )
        self._stride_period = self._phase_lag = ""
        # Made last: discovery goes in this order, so who answers here knows the action client too.
        self._asking = {n: self._node.create_client(Ready, f"{n}/ready") for n in ASKED}
        self._asked_at = self._looked_at = time.monotonic()
        self._heard_at = dict.fromkeys(ASKED, self._looked_at)
        self._answered: set[str] = set()

    def conduct(self, protocol_text: str) -> tuple[str, str]:
        """
        Conduct a protocol to its end.

        Returns
        -------
        failure
            Why the run failed, or an empty text.
        blamed
            The node whose log may tell more, or an empty text.

        """
        deadline = time.monotonic() + APPEARANCE_TIMEOUT
        while not (self._client.server_is_ready() and "experiment" in self._answered):
            if time.monotonic() > deadline:
                return f"experiment did not appear within {APPEARANCE_TIMEOUT:g} s", "experiment"
            ended = self._spin()
            if ended:
                return ended
        goal_future = self._client.send_goal_async(
            RunProtocol.Goal(protocol=protocol_text), feedback_callback=self._on_feedback
        )
        result_future = None
        while result_future is None or not result_future.done():
            ended = self._spin()
            if ended:
                return ended
            if result_future is None and goal_future.done():
                goal = goal_future.result()
                if not goal.accepted:
                    return "experiment rejected the protocol: it conducts another", "experiment"
                result_future = goal.get_result_async()
        self._bar.close()
        answer = result_future.result()
        result = answer.result
        if answer.status == GoalStatus.STATUS_SUCCEEDED:
            return "", ""
        return result.message or "experiment failed", result.blamed

    def close(self) -> None:
        """Leave the ROS graph."""
        self._bar.close()
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def _spin(self) -> tuple[str, str] | None:
        """Serve ROS for a moment; return failure and node where one has ended or is stuck."""
        self._executor.spin_once(timeout_sec=0.05)
        for node, code in self._supervisor.ended().items():
            # The recorder ends by itself once the record is complete.
            if node != "bag_recorder" or code != 0:
                return f"{node} ended unexpectedly with exit code {code}", node
        silent = self._silent_node()
        if silent:
            return f"{silent} has been silent for {SILENCE_TIMEOUT:g} s", silent
        return None

    def _silent_node(self) -> str:
        """Ask the nodes for a sign of life; return one that has owed it for too long."""
        now = time.monotonic()
        if now - self._looked_at > HELD_UP:
            self._heard_at = dict.fromkeys(ASKED, now)
        self._looked_at = now
        if now - self._asked_at > ASKING_PERIOD:
            self._asked_at = now
            for node, client in self._asking.items():
                if client.service_is_ready():
                    answer = client.call_async(Ready.Request())
                    answer.add_done_callback(partial(self._on_answer, node))
        for node in set(ASKED) - self._answered:  # still starting
            self._heard_at[node] = now
        silent = [node for node in ASKED if now - self._heard_at[node] > SILENCE_TIMEOUT]
        return silent[0] if silent else ""

    def _on_answer(self, node: str, _: Any) -> None:
        self._heard_at[node] = time.monotonic()
        self._answered.add(node)

    def _on_feedback(self, message: Any) -> None:
        state: ExperimentState = message.feedback.state
        self._bar.update(state.stride - self._bar.n)

    def _on_stride(self, stride: Stride) -> None:
        self._stride_period = f"period {stride.period:.4f} s"
        self._show()

    def _on_pulse(self, pulse: PulsePhase) -> None:
        self._phase_lag = f"lag {pulse.phase_lag * 1e3:+.0f} ms"
        self._show()

    def _show(self) -> None:
        self._bar.set_postfix_str(f"{self._stride_period} {self._phase_lag}", refresh=False)
