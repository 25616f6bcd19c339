# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
perturbator: lifecycle node that holds one ankle robot and turns pulse trains into torque.

It answers every horizon of the experiment with a torque profile and the promise that nothing in
it will change. It knows nothing of gait. Torque ends with deactivation, with cancelling, with
the latched stop service and with the process, whatever ends that.

A horizon that is known to its end closes the run: it is answered with a profile without length,
after which there is no torque that could be stopped.
"""

import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy._rclpy_pybind11 import RCLError
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.task import Future
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.device import (
    DeviceLimits,
    IdealAnkleRobot,
    LimitError,
    PulseTrain,
    find_driver,
)
from gait_entrainment.device import TorqueProfile as CoreProfile
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import AnkleRobotState, Horizon, TorqueProfile, TorquePulse
from gait_entrainment_nodes.node import Participant, declare, declare_fields, run_node
from gait_entrainment_nodes.stamps import header, to_nanoseconds, to_time
from gait_entrainment_nodes.topics import HORIZON, PULSES, ROBOT_STATE, TORQUE_PROFILE


class Perturbator(Participant, LifecycleNode):
    """ROS side of the ankle robot: lifecycle, action, promises. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("perturbator")
        side = declare(self, "side", "right", "ankle on which the robot sits: left or right")
        if side not in ("left", "right"):
            raise ValueError(f"side: {side!r}; allowed: left, right")
        self.side = Side[side.upper()]
        self.driver = declare(self, "driver", "ideal", "ankle robot driver")
        self.limits = declare_fields(self, DeviceLimits, "limits")
        self.begin_participation()

        self.profiles = self.publisher(TORQUE_PROFILE)
        self.pulses = self.publisher(PULSES)
        self.states = self.publisher(ROBOT_STATE)

        self.robot: IdealAnkleRobot | None = None  # of the run that goes on
        self.active = False
        self.stopped = False  # latched by the stop service until cleanup and configure
        self.run_number = 0
        self.revision = 0
        self.now = 0  # latest instant that is known to be over [ns since 1970]
        self._goal: Any = None
        self._goal_ended: Future | None = None  # its result: (outcome, message, delivered)

        self.subscription(HORIZON, self.on_horizon)
        self.create_service(Trigger, "~/stop", self.on_stop_service)
        self._server = ActionServer(
            self,
            DeliverPulseTrain,
            "~/deliver_pulse_train",
            execute_callback=self.execute,
            goal_callback=self.on_goal,
            cancel_callback=self.guarded(self.on_cancel),
        )

    # Lifecycle

    def _LifecycleNodeMixin__on_change_state(self, request: Any, response: Any) -> Any:  # noqa: N802
        """
        Refuse a transition that there is not from the present state.

        Jazzy's rclpy raises an exception there, which would end the node.
        """
        try:
            return super()._LifecycleNodeMixin__on_change_state(request, response)
        except RCLError as error:
            self.get_logger().error(f"transition {request.transition.id} refused: {error}")
            response.success = False
            return response

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Load the driver; releases a latched stop."""
        try:
            self.make_robot = find_driver(self.driver)
        except LimitError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        self.stopped = False
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Allow torque; refused while a stop is latched."""
        if self.stopped:
            self.get_logger().error("a stop is latched: clean up and configure first")
            return TransitionCallbackReturn.FAILURE
        self.active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero, then forbid it."""
        self.end_torque(DeliverPulseTrain.Result.STOPPED, "the perturbator was deactivated")
        self.active = False
        return super().on_deactivate(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero."""
        return self.on_deactivate(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero."""
        return self.on_deactivate(state)

    def on_stop(self) -> None:
        """End of the process: bring the torque to zero."""
        self.end_torque(DeliverPulseTrain.Result.STOPPED, "the perturbator was shut down")

    def on_stop_service(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Bring the torque to zero and keep it there until cleanup and configure."""
        self.stopped = True
        self.end_torque(DeliverPulseTrain.Result.STOPPED, "the stop service was called")
        self.diagnose(self.now, DiagnosticStatus.ERROR, "stopped by service; latched")
        response.success, response.message = True, "torque is zero, latched"
        return response

    def end_torque(self, outcome: int, reason: str) -> None:
        """Bring the torque to zero now, whatever was promised."""
        self.end_goal(outcome, reason)
        if self.robot is not None and self.robot.committed:
            self.robot.cancel()
            self.profiles.publish(
                TorqueProfile(
                    header=header(self.now),
                    run=self.run_number,
                    side=self.side,
                    stop=True,
                    revision=self.revision,
                    valid_until=to_time(self.robot.promised_until),
                )
            )
            self.revision += 1
            self.publish_state(self.now, 0.0)

    # The action

    def on_goal(self, goal: DeliverPulseTrain.Goal) -> GoalResponse:
        """Accept a train that the robot can deliver, one at a time."""
        try:
            reason = self.schedule(goal)
        except Exception as error:  # it must not reach the executor, which would crash
            self.fail_with(error)
            return GoalResponse.REJECT
        if reason:
            self.get_logger().error(f"pulse train rejected: {reason}")
            self.diagnose(self.now, DiagnosticStatus.WARN, f"pulse train rejected: {reason}")
            return GoalResponse.REJECT
        self._goal_ended = Future()
        return GoalResponse.ACCEPT

    def schedule(self, goal: DeliverPulseTrain.Goal) -> str:
        """Schedule a train; return why it cannot be, or an empty text."""
        if not self.active:
            return "the perturbator is not active"
        if self.stopped:
            return "a stop is latched: clean up and configure first"
        if self._goal_ended is not None:
            return "a pulse train is under way; allowed: one at a time"
        if self.robot is None or goal.run != self.run_number:
            return f"run: {goal.run} is not under way"
        try:
            self.robot.schedule(
                PulseTrain(
                    side=Side(goal.side),
                    first_onset=to_nanoseconds(goal.first_onset),
                    period=goal.period,
                    count=goal.count,
                    torque=goal.torque,
                    duration=goal.duration,
                )
            )
        except LimitError as error:
            return str(error)
        return ""

    async def execute(self, goal: Any) -> DeliverPulseTrain.Result:
        """Wait for the end of a train and say how it ended."""
        assert self._goal_ended is not None
        self._goal = goal
        outcome, message, delivered = await self._goal_ended
        if outcome == DeliverPulseTrain.Result.CANCELLED:
            goal.canceled()
        elif outcome == DeliverPulseTrain.Result.DELIVERED:
            goal.succeed()
        else:
            goal.abort()
        self._goal = self._goal_ended = None
        return DeliverPulseTrain.Result(outcome=outcome, delivered=delivered, message=message)

    def end_goal(self, outcome: int, message: str) -> None:
        """Let the running goal, if any, end."""
        if self._goal_ended is not None and not self._goal_ended.done():
            delivered = self.robot.delivered if self.robot is not None else 0
            self._goal_ended.set_result((outcome, message, delivered))

    def on_cancel(self, _: Any) -> CancelResponse:
        """Bring the torque to zero now: the next horizon may be long in coming."""
        self.end_torque(DeliverPulseTrain.Result.CANCELLED, "cancelled by the client")
        return CancelResponse.ACCEPT

    # Promises

    def on_horizon(self, message: Horizon) -> None:
        """Answer a horizon with the torque up to it, promised."""
        new = message.run != self.run_number
        if not (self.active if new else self.robot is not None):
            return
        self.now = to_nanoseconds(message.header.stamp)
        if new:
            self.robot = self.make_robot(self.side, self.now, self.limits)
            self.run_number, self.revision = message.run, 0
        assert self.robot is not None
        until = to_nanoseconds(message.until)
        if self.now >= until:
            self.end_goal(DeliverPulseTrain.Result.ENDED, "the run ended before the last pulse")
            self.publish_profile(CoreProfile(self.side, (until,), (0.0,), (), until), message.last)
            self.robot = None
            self.publish_counts(self.run_number, until)
            return
        first = self.robot.delivered + 1
        profile = self.robot.promise(until)
        self.publish_profile(profile, message.last)
        for number, onset in enumerate(profile.onsets, first):
            self.announce_pulse(number, onset)
        if not self.robot.busy:
            self.end_goal(DeliverPulseTrain.Result.DELIVERED, "every pulse was delivered")

    def publish_profile(self, profile: CoreProfile, last: bool) -> None:
        """Publish a promise, and the robot's state at every change of torque in it."""
        self.profiles.publish(
            TorqueProfile(
                header=header(profile.times[0]),
                run=self.run_number,
                revision=self.revision,
                side=self.side,
                times=[to_time(t) for t in profile.times],
                torques=profile.torques,
                onsets=[to_time(t) for t in profile.onsets],
                valid_until=to_time(profile.valid_until),
                last=last,
            )
        )
        self.revision += 1
        for instant, torque in zip(profile.times, profile.torques, strict=True):
            self.publish_state(instant, torque)

    def announce_pulse(self, number: int, onset: int) -> None:
        """Tell people, tools and the client of one pulse."""
        train = self.robot.train if self.robot is not None else None
        assert train is not None
        self.pulses.publish(
            TorquePulse(
                header=header(onset),
                run=self.run_number,
                side=self.side,
                number=number,
                torque=train.torque,
                duration=train.duration,
            )
        )
        if self._goal is not None:
            self._goal.publish_feedback(
                DeliverPulseTrain.Feedback(number=number, onset=to_time(onset))
            )

    def publish_state(self, instant: int, torque: float) -> None:
        """Publish the robot's state; the ideal robot changes only where its torque does."""
        status = AnkleRobotState.ACTIVE if self.active else AnkleRobotState.INACTIVE
        self.states.publish(
            AnkleRobotState(
                header=header(instant),
                run=self.run_number,
                side=self.side,
                status=AnkleRobotState.STOPPED if self.stopped else status,
                commanded_torque=torque,
                measured_torque=torque,
                angle=float("nan"),
            )
        )


def main() -> int:
    """Run the node."""
    return run_node(Perturbator, sys.argv)


if __name__ == "__main__":
    sys.exit(main())
