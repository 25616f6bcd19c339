# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
perturbator: lifecycle node that holds one ankle robot and turns pulse trains into torque.

It answers every horizon of the experiment with a torque profile and the promise that nothing in
it will change. It knows nothing of gait. Torque ends with deactivation, with cancelling, with
the latched stop service and with the process, whatever ends that.

A horizon that is known to its end closes the run: it is answered with a profile without length,
after which there is no torque that could be stopped.

A robot in simulated time answers a horizon at once and in full. A real one knows its torque only
afterwards, in real time: what it has measured is promised every few milliseconds, up to the
horizon.
"""

import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy._rclpy_pybind11 import RCLError
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.task import Future
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    Fault,
    GuardedRobot,
    LimitError,
    PulseTrain,
    RobotState,
    find_driver,
)
from gait_entrainment.robot import TorqueProfile as CoreProfile
from gait_entrainment.robot.faults import NOT_STOPPED, STOPPED
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import AnkleRobotState, Horizon, TorqueProfile, TorquePulse
from gait_entrainment_nodes.messaging.stamps import header, to_nanoseconds, to_time
from gait_entrainment_nodes.messaging.topics import HORIZON, PULSES, ROBOT_STATE, TORQUE_PROFILE
from gait_entrainment_nodes.nodes.node import (
    Participant,
    declare,
    declare_fields,
    declare_side,
    fields_of,
    run_node,
    side_of,
)

# How often what a real robot has measured is promised [s].
MEASURED_PERIOD = 0.01


class Perturbator(Participant, LifecycleNode):
    """ROS side of the ankle robot: lifecycle, action, promises. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("perturbator")
        declare_side(self, "side", "ankle on which the robot sits: left or right")
        declare(
            self,
            "driver",
            "ideal",
            "name of the ankle robot driver: NAME or NAME:OPTION=VALUE,...",
            read_only=False,
        )
        declare(
            self,
            "seed",
            0,
            "seed of a driver that draws random numbers",
            unit="1",
            within=(0, 2**32 - 1),
            read_only=False,
        )
        declare(
            self,
            "armed",
            False,
            "arm a real robot on activation; else a person does it by the service ~/arm",
            read_only=False,
        )
        declare_fields(self, DeviceLimits, "limits.")
        self.robot: GuardedRobot | None = None  # from configuring to cleaning up
        self.stop_latched = False  # the stop service was called while there was no robot
        self.begin_participation()

        self.profiles = self.publisher(TORQUE_PROFILE)
        self.pulses = self.publisher(PULSES)
        self.states = self.publisher(ROBOT_STATE)

        self.open = False  # a run goes on whose closing horizon has not come
        self.committed = False  # torque may still come, of a train that was accepted
        self.reported: tuple[Fault, ...] = ()  # faults that /diagnostics has been told of
        self.run_number = 0
        self.revision = 0
        self.now = 0  # latest instant that is known to be over [ns since 1970]
        self.horizon = 0  # up to which a real robot owes its torque [ns since 1970]
        self.last = False  # the run ends there
        self.look_at: float | None = None  # when to look after a real robot, steady time [s]
        self._goal: Any = None
        self._goal_ended: Future | None = None  # its result: (outcome, message, delivered)

        self.subscription(HORIZON, self.on_horizon)
        self.create_service(Trigger, "~/stop", self.on_stop_service)
        self.create_service(Trigger, "~/arm", self.on_arm_service)
        self._server = ActionServer(
            self,
            DeliverPulseTrain,
            "~/deliver_pulse_train",
            execute_callback=self.execute,
            goal_callback=self.on_goal,
            handle_accepted_callback=self.guarded(self.on_accepted),
            cancel_callback=self.guarded(self.on_cancel),
        )

    # Parameters: the robot is configured with them

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now: the robot has been made with it."""
        del name
        return "the robot is configured; clean it up first" if self.robot is not None else ""

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """Take what the next robot is made with."""
        side = side_of("side", value)
        try:
            find_driver(value("driver"))
        except DeviceError as error:
            raise ValueError(str(error)) from None
        self.limits = fields_of(DeviceLimits, value, "limits.")
        self.side, self.driver = side, value("driver")
        self.hardware_id = self.driver
        self.seed, self.armed = value("seed"), value("armed")

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
        """
        Connect to the robot; no torque is possible yet. Releases what was latched before.

        Refused once where somebody stopped before there was a robot: a run that is about to
        begin would otherwise release the stop by itself.
        """
        try:
            if self.stop_latched:
                self.stop_latched = False
                raise DeviceError("the stop service was called; configure again to release it")
            driver = find_driver(self.driver)
            if self.get_parameter("use_sim_time").value and not driver.simulated:
                raise DeviceError(
                    f"driver: {driver.name} runs in real time only: use_sim_time must be off"
                )
            robot = driver.make(self.side, self.limits, self.seed)
            robot.configure()
        except (LimitError, DeviceError) as error:
            return self.refuse(error)
        self.robot, self.reported = robot, ()
        self.note_state(DiagnosticStatus.OK, "configured")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Enable the robot at zero torque; refused while a stop is latched."""
        assert self.robot is not None
        try:
            self.robot.activate()
            if self.armed:
                self.robot.arm()
        except DeviceError as error:
            return self.refuse(error)
        if not self.robot.capabilities.simulated:
            self.look_at = time.monotonic()
        self.note_state(DiagnosticStatus.OK, "active")
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero, then disable the robot."""
        self.end_torque(DeliverPulseTrain.Result.STOPPED, "the perturbator was deactivated")
        if self.robot is not None:
            self.robot.deactivate()
            self.report_faults()
            if not self.robot.faults:
                self.note_state(DiagnosticStatus.OK, "inactive")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release the robot."""
        self.release()
        self.note_state(DiagnosticStatus.OK, "unconfigured")
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero and release the robot."""
        result = self.on_deactivate(state)
        self.release()
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero and release the robot."""
        return self.on_shutdown(state)

    def on_stop(self) -> None:
        """End of the process: bring the torque to zero and release the robot."""
        try:
            self.end_torque(DeliverPulseTrain.Result.STOPPED, "the perturbator was shut down")
        finally:
            self.release()

    def release(self) -> None:
        """Bring the torque to zero and let go of the robot."""
        robot, self.robot = self.robot, None
        self.open = self.committed = False
        self.look_at = None
        if robot is not None:
            robot.close()

    def refuse(self, error: Exception) -> TransitionCallbackReturn:
        """Say why a transition is refused."""
        self.get_logger().error(str(error))
        self.diagnose(self.now, DiagnosticStatus.ERROR, str(error))
        return TransitionCallbackReturn.FAILURE

    def on_arm_service(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Allow a real robot torque: a person has seen that all is well."""
        try:
            if self.robot is None:
                raise DeviceError("the perturbator is not active")
            self.robot.arm()
        except DeviceError as error:
            response.message = str(error)
        else:
            response.success, response.message = True, "armed: torque is possible from now on"
            self.diagnose(self.now, DiagnosticStatus.OK, "armed")
        return response

    def on_stop_service(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Bring the torque to zero and keep it there until cleanup and configure."""
        if self.robot is not None:
            self.robot.stop()
            self.report_faults("the stop service was called")
        else:
            self.stop_latched = True
        response.success, response.message = True, "torque is zero, latched"
        if self.robot is not None and NOT_STOPPED in self.robot.faults:
            response.success, response.message = False, NOT_STOPPED.meaning
        return response

    def end_torque(self, outcome: int, reason: str) -> None:
        """Bring the torque to zero now, whatever was promised."""
        robot = self.robot
        if robot is not None:
            robot.cancel()  # the robot first, whatever becomes of the messages
        self.end_goal(outcome, reason)
        if robot is None or not self.committed:
            return
        self.committed = False
        self.profiles.publish(
            TorqueProfile(
                header=header(self.now),
                run=self.run_number,
                side=self.side,
                stop=True,
                revision=self.revision,
                valid_until=to_time(robot.promised_until),
            )
        )
        self.revision += 1
        self.publish_state(RobotState(self.now, 0.0, 0.0, float("nan")))

    def report_faults(self, reason: str = "") -> None:
        """Tell of faults that are new; each has ended the torque, and ends the goal."""
        robot = self.robot
        if robot is None or robot.faults == self.reported:
            return
        new = [fault for fault in robot.faults if fault not in self.reported]
        self.reported = robot.faults
        for fault in new:
            told = f"latched: {fault.name}: {reason or fault.meaning}"
            self.get_logger().error(told)
            self.diagnose(self.now, DiagnosticStatus.ERROR, told)
        if NOT_STOPPED in new:
            self.failure = NOT_STOPPED.meaning
        reason = reason or "; ".join(f"{fault.name}: {fault.meaning}" for fault in new)
        self.committed |= self.open  # in a run the stop is told also where no torque was due
        self.end_torque(DeliverPulseTrain.Result.STOPPED, reason)

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
        if self.robot is None:
            return "the perturbator is not active"
        if self._goal_ended is not None:
            return "a pulse train is under way; allowed: one at a time"
        if not self.open or goal.run != self.run_number:
            return f"run: {goal.run} is not under way"
        if goal.side not in tuple(Side):
            return f"side: {goal.side}; allowed: 0 (left), 1 (right)"
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
        except (LimitError, DeviceError) as error:
            return str(error)
        self.committed = True
        return ""

    def on_accepted(self, goal: Any) -> None:
        """
        Execute a goal only once its train has ended.

        The executor resumes a coroutine that waits over and over: for as long as pulses come it
        would fight the torque loop for the interpreter.
        """
        assert self._goal_ended is not None
        self._goal = goal
        self._goal_ended.add_done_callback(lambda _: goal.execute())

    def execute(self, goal: Any) -> DeliverPulseTrain.Result:
        """Say how a train ended."""
        assert self._goal_ended is not None
        outcome, message, delivered = self._goal_ended.result()
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
        robot = self.robot
        new = message.run != self.run_number
        if robot is None or not (robot.enabled if new else self.open):
            return
        if new:
            self.end_torque(DeliverPulseTrain.Result.STOPPED, "another run began")
        self.now = to_nanoseconds(message.header.stamp)
        self.horizon, self.last = to_nanoseconds(message.until), message.last
        if new:
            robot.begin(self.now)
            self.run_number, self.revision, self.open = message.run, 0, True
            self.committed = False
        robot.heard()
        if self.now >= self.horizon:
            self.end_goal(DeliverPulseTrain.Result.ENDED, "the run ended before the last pulse")
            end = self.horizon
            self.publish_profile(CoreProfile(self.side, (end,), (0.0,), (), end), self.last)
            self.publish_state(RobotState(end, 0.0, 0.0, float("nan")))
            robot.cancel()
            self.open = self.committed = False
            self.publish_counts(self.run_number, end)
        else:
            self.deliver(robot)

    def deliver(self, robot: GuardedRobot) -> None:
        """Promise what is known of the torque up to the horizon."""
        first = robot.delivered + 1
        train = robot.train
        try:
            profile = robot.promise(self.horizon)
            states = robot.read()
        except DeviceError as error:
            self.report_faults()
            self.failure = str(error)
            return
        if profile.valid_until > profile.times[0]:
            self.publish_profile(profile, self.last and profile.valid_until == self.horizon)
        for number, onset in enumerate(profile.onsets, first):
            assert train is not None
            self.announce_pulse(number, onset, train)
        for state in states:
            self.publish_state(state)
        self.report_faults()
        if not robot.busy:
            self.end_goal(DeliverPulseTrain.Result.DELIVERED, "every pulse was delivered")

    def next_deadline(self) -> float | None:
        """Return when a real robot is to be looked after."""
        return self.look_at

    def on_deadline(self) -> None:
        """Promise what a real robot has measured, and note its faults."""
        robot = self.robot
        if robot is None:
            return
        self.look_at = time.monotonic() + MEASURED_PERIOD
        if self.open and robot.promised_until < self.horizon:
            self.deliver(robot)
        else:
            self.look_after(robot)

    def look_after(self, robot: GuardedRobot) -> None:
        """Note states and faults of a robot of which no torque is asked for at the moment."""
        try:
            states = robot.read()
        except DeviceError as error:
            states, self.failure = (), str(error)
        # In a run the next horizon is only late, and every state belongs to the record.
        for state in states if self.open else ():
            self.publish_state(state)
        self.report_faults()

    def publish_profile(self, profile: CoreProfile, last: bool) -> None:
        """Publish a promise."""
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

    def announce_pulse(self, number: int, onset: int, train: PulseTrain) -> None:
        """Tell people, tools and the client of one pulse."""
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

    def publish_state(self, state: RobotState) -> None:
        """Publish the robot's state at one instant."""
        robot = self.robot
        assert robot is not None
        status = AnkleRobotState.ACTIVE if robot.enabled else AnkleRobotState.INACTIVE
        if robot.faults:
            status = AnkleRobotState.FAULT
        if STOPPED in robot.faults:
            status = AnkleRobotState.STOPPED
        self.states.publish(
            AnkleRobotState(
                header=header(state.stamp),
                run=self.run_number,
                side=self.side,
                status=status,
                commanded_torque=state.commanded,
                measured_torque=state.measured,
                angle=state.angle,
                faults=[fault.name for fault in (state.faults or robot.faults)],
            )
        )


def main() -> int:
    """Run the node."""
    return run_node(Perturbator)
