# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
perturbator: lifecycle node that holds the ankle robots and turns pulse trains into torque.

It answers every horizon of the experiment with a torque profile, which it promises not to change
(perturbator_run.py). It knows nothing about gait. Torque ends on deactivation, on cancelling, by
the latched stop service, and with the process, however that ends.
"""

import time
from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    DeviceLimits,
    Dose,
    Fault,
    GuardedRobot,
    LimitError,
    PlannedPulses,
    driver_on,
    find_driver,
    make_robots,
)
from gait_entrainment.robot.faults import NOT_STOPPED
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import MessageError, nanoseconds_of, train_of
from gait_entrainment_drivers.proof import require_proof
from gait_entrainment_drivers.stop_channel import StopAnswer
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import Horizon, Trouble
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.environment import user_and_host
from gait_entrainment_nodes.messaging.stamps import header
from gait_entrainment_nodes.nodes.goal_server import GoalServer
from gait_entrainment_nodes.nodes.parameters import texts
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.perturbator_run import Run, SignsOfLife, do_with_all, setups
from gait_entrainment_nodes.nodes.rclpy_internals import TolerantLifecycleNode
from gait_entrainment_nodes.nodes.stop_thread import StopThread

Result = DeliverPulseTrain.Result
# How often to promise what a real robot has measured [s].
MEASURED_PERIOD = 0.01


@dataclass(frozen=True)
class Settings:
    """Parameters of the node, in addition to the limits of the robot."""

    side: Side = setting(Side.RIGHT, "ankle that wears the robot: left or right")
    both_ankles: bool = setting(False, "whether the other ankle wears a robot, too")
    driver: str = setting("ideal", "ankle robot driver: NAME or NAME:OPTION=VALUE,...")
    seed: int = setting(0, "seed for a driver that draws random numbers", "1", (0, 2**32 - 1))
    armed: bool = setting(
        False, "arm a real robot on activation; otherwise a person calls the service ~/arm"
    )
    unproved: bool = setting(
        False,
        "arm a real robot even if its own watchdog was not proved on this computer; recorded",
    )
    operator_timeout: float = setting(
        0.0,
        "longest silence of operator/heartbeat while torque is possible; 0: nobody needs to watch",
        "s",
        (0.0, 60.0),
    )
    operators: tuple[str, ...] = texts(
        "names on operator/heartbeat that must all be heard; empty: any name will do"
    )
    deadman_timeout: float = setting(
        0.0,
        "longest silence of ~/emergency_stop while torque is possible; 0: silence is allowed",
        "s",
        (0.0, 60.0),
    )

    def __post_init__(self) -> None:
        find_driver(self.driver)  # raises DeviceError if there is no such driver


class Perturbator(Participant, TolerantLifecycleNode):
    """ROS side of the ankle robot: lifecycle, action, services."""

    settings: Settings  # the next robot is configured with them
    limits: DeviceLimits
    planned: PlannedPulses
    run: Run | None

    def __init__(self) -> None:
        super().__init__(
            "perturbator",
            settings=Settings,
            limits=(DeviceLimits, "limits."),
            planned=(PlannedPulses, "planned."),
        )
        self._robots: dict[Side, GuardedRobot] = {}  # from configuration to cleanup
        self._dose = Dose()  # of all wearers since this node was started
        self._armed_by = ""
        self._stop_latched = False  # stopped while there was no robot
        self._reported: tuple[Fault, ...] = ()  # faults that have been published
        for topic in (topics.TORQUE_PROFILE, topics.PULSES, topics.ROBOT_STATE):
            self.offer(topic)
        self.offer(topics.ROBOT_SETUP)
        self.offer(topics.TROUBLE)
        self._now = 0  # latest time that is known to be past [ns since 1970]
        self._latest_run = 0  # number of the latest run
        self._foreign_seal = ""  # of the latest horizon that was not from the run's experiment
        self._read_at: float | None = None  # when to read a real robot, steady time [s]
        self._signs = SignsOfLife()
        self._pressed = False  # the emergency stop, by its latest message
        self._buttons = 0  # how many nodes can press it
        self._stop_thread = StopThread(self.get_name(), self._stop_at_once)

        self.subscribe(topics.HORIZON, self._on_horizon)
        self.subscribe(topics.OPERATOR_HEARTBEAT, self._on_heartbeat)
        for qos in topics.FROM_A_BUTTON:
            self.subscribe(topics.EMERGENCY_STOP._replace(qos=qos), self._on_emergency_stop)
        self.create_service(Trigger, "~/stop", self.on_stop_service)
        self.create_service(Trigger, "~/arm", self._on_arm_service)
        name = "~/deliver_pulse_train"
        self._server = GoalServer(
            self, DeliverPulseTrain, name, accept=self._on_goal, cancel=self.on_cancel
        )

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now: the robot was configured with it."""
        del name
        return "the robot is configured; clean it up first" if self._robots else ""

    @property
    def hardware_id(self) -> str:
        """The driver, by its name and options."""
        return self.settings.driver

    # Lifecycle

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """
        Connect to the robot; no torque is possible yet. Releases what was latched before.

        Refused once after a stop before there was a robot: a run that is about to start would
        otherwise release the stop by itself.
        """
        settings = self.settings
        try:
            if self._pressed and self.count_publishers("~/emergency_stop"):
                raise DeviceError("the emergency stop is pressed; release it first")
            if self._take_stop():
                raise DeviceError("the stop service was called; configure again to release it")
            driver = find_driver(settings.driver)
            if self.get_parameter("use_sim_time").value and not driver.simulated:
                raise DeviceError(
                    f"driver: {driver.name} runs in real time only: use_sim_time must be off"
                )
            sides = (settings.side, settings.side.other)[: 1 + settings.both_ankles]
            arguments = settings.driver, sides, self.limits, settings.seed, self._dose
            robots = make_robots(*arguments)
            do_with_all(robots, GuardedRobot.configure, GuardedRobot.close)
        except (LimitError, DeviceError) as error:
            return self._refuse(error)
        self._robots, self._reported, self._armed_by = robots, (), ""
        if self._take_stop():  # while they were being connected
            self._stop_at_once()
        self.note_state(DiagnosticStatus.OK, "configured")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Enable the robot at zero torque; refused while a stop is latched."""
        try:
            do_with_all(self._robots, GuardedRobot.activate, GuardedRobot.deactivate)
            if self.settings.armed:
                self._arm("the parameter armed")
        except DeviceError as error:
            return self._refuse(error)
        if not self._simulated:
            self._read_at = time.monotonic()
        self.note_state(DiagnosticStatus.OK, "active")
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero, then disable the robot."""
        self._end_torque("the perturbator was deactivated")
        if self._robots:
            for robot in self._robots.values():
                robot.deactivate()
            self._report_faults()
            if not self._faults:
                self.note_state(DiagnosticStatus.OK, "inactive")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release the robot."""
        self._release()
        self.note_state(DiagnosticStatus.OK, "unconfigured")
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the torque to zero and release the robot."""
        result = self.on_deactivate(state)
        self._release()
        return result

    on_error = on_shutdown

    def on_stop(self) -> None:
        """End of the process: bring the torque to zero and release the robot."""
        try:
            self._end_torque("the perturbator was shut down")
        finally:
            self._release()
            self._stop_thread.close()

    def _release(self) -> None:
        """Bring the torque to zero and release the robots."""
        robots, self._robots = self._robots, {}
        self.run = self._read_at = None
        for robot in robots.values():
            robot.close()

    @property
    def _simulated(self) -> bool:
        return all(robot.capabilities.simulated for robot in self._robots.values())

    @property
    def _faults(self) -> tuple[Fault, ...]:
        """Faults that have latched the torque at zero, in order."""
        return tuple({f: None for robot in self._robots.values() for f in robot.faults})

    def _refuse(self, error: Exception) -> TransitionCallbackReturn:
        self._report(DiagnosticStatus.ERROR, str(error))
        return TransitionCallbackReturn.FAILURE

    # Stopping, arming, faults

    def _arm(self, how: str) -> None:
        """Allow torque and record who did so; raises DeviceError if that is not permitted."""
        if not self._robots:
            raise DeviceError("the perturbator is not active")
        for side in self._robots if not self._simulated else ():
            driver = driver_on(self.settings.driver, side)
            require_proof(driver, unproved=self.settings.unproved)
        for robot in self._robots.values():
            robot.arm()
        if not self._simulated:
            self._armed_by = f"{user_and_host()}, by {how}"
        if self.run is not None:
            self._publish_setup()

    def _on_arm_service(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        try:
            self._arm("the service ~/arm")
        except DeviceError as error:
            response.message = str(error)
        else:
            response.success, response.message = True, "armed: torque is possible from now on"
            self.diagnose(self._now, DiagnosticStatus.OK, "armed")
        return response

    def _take_stop(self) -> bool:
        """Return once whether the torque was stopped while there was no robot."""
        stopped, self._stop_latched = self._stop_latched, False
        return stopped

    def _stop_at_once(self) -> StopAnswer:
        """Bring the torque to zero and keep it there; callable from any thread."""
        robots = self._robots.values()
        if not robots:
            self._stop_latched = True
            return StopAnswer(True, "no robot is configured; the next configuration is refused")
        for robot in robots:
            robot.stop()
        if NOT_STOPPED in self._faults:
            return StopAnswer(False, NOT_STOPPED.meaning)
        return StopAnswer(True, "the stop is latched")

    def on_stop_service(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Bring the torque to zero and keep it there until cleanup and configure."""
        answer = self._stop_at_once()
        self._report_faults("the stop service was called")
        response.success, response.message = answer.done, answer.message
        return response

    def _on_emergency_stop(self, message: Any) -> None:
        self._signs.hear()
        self._pressed = message.data
        if message.data:
            self._stop_at_once()
            self._report_faults("the emergency stop was pressed")

    def _on_heartbeat(self, message: Any) -> None:
        self._signs.hear(message.data)

    def _require_signs_of_life(self) -> None:
        """End the torque if an operator or an emergency stop is missing."""
        robots = self._robots.values()
        buttons = self.count_publishers("~/emergency_stop")
        gone, self._buttons = buttons < self._buttons, buttons
        if all(robot.train is None for robot in robots):
            return
        for fault, reason in self._signs.missing(self.settings, button_gone=gone):
            for robot in robots:
                robot.stop(fault)
            self._report_faults(reason)

    def _end_torque(self, reason: str, outcome: int = Result.STOPPED) -> None:
        """Bring the torque to zero now, whatever was promised."""
        if self.run is not None:
            self.run.end_torque(outcome, reason)

    def _report_faults(self, reason: str = "") -> None:
        """Report new faults; each has ended the torque, and ends the goal."""
        faults = self._faults
        new = [fault for fault in faults if fault not in self._reported]
        if not new:
            return
        self._reported = faults
        for fault in new:
            what = f"latched: {fault.name}: {reason or fault.meaning}"
            self._report(DiagnosticStatus.ERROR, what, fault)
        if NOT_STOPPED in new:
            self.failure = NOT_STOPPED.meaning
        if self.run is not None:
            reason = reason or "; ".join(f"{fault.name}: {fault.meaning}" for fault in new)
            self.run.end_torque(Result.STOPPED, reason, fault=True)

    def _report(self, level: bytes, message: str, fault: Fault | None = None) -> None:
        """Report a refusal or a latched fault to the experiment and to people."""
        self.get_logger().error(message)
        trouble = Trouble(
            header=header(self._now),
            run=self._latest_run,
            kind=Trouble.REFUSED if fault is None else Trouble.LATCHED,
            fault="" if fault is None else fault.name,
            message=message,
        )
        self.publish(topics.TROUBLE, trouble)
        self.diagnose(self._now, level, message)

    def _publish_setup(self) -> None:
        """Publish for the record what is driven, within which limits, and who allowed torque."""
        for setup in setups(self._robots, self.settings.driver, self._armed_by):
            setup.header, setup.run = header(self._now), self._latest_run
            self.publish(topics.ROBOT_SETUP, setup)

    # The action

    def _on_goal(self, goal: DeliverPulseTrain.Goal) -> bool:
        """Schedule a train if the robot can deliver it; return whether it can."""
        try:
            self._schedule(goal)
        except (LimitError, DeviceError, MessageError) as error:
            self._report(DiagnosticStatus.WARN, f"pulse train rejected: {error}")
            return False
        return True

    def _schedule(self, goal: DeliverPulseTrain.Goal) -> None:
        if not self._robots:
            raise DeviceError("the perturbator is not active")
        if self.run is None or goal.run != self.run.number:
            raise LimitError(f"run: {goal.run} is not under way")
        train = train_of(goal)
        self.planned.check(train, self.run.requested)
        self.run.schedule(train, goal.key)

    def on_cancel(self) -> None:
        """Bring the torque to zero now, because the next horizon may be far off."""
        self._end_torque("cancelled by the client", Result.CANCELLED)

    # Promises

    def publish(self, topic: topics.Topic, message: Any) -> None:
        """Publish a message; the client that requested pulses gets feedback for each."""
        super().publish(topic, message)
        if topic is topics.PULSES:
            number, onset = message.number, message.header.stamp
            feedback = DeliverPulseTrain.Feedback(number=number, onset=onset)
            self._server.publish_feedback(feedback, message.side)

    def _on_horizon(self, message: Horizon) -> None:
        """Answer a horizon by promising the torque up to it."""
        robots = self._robots
        new = message.run != self._latest_run
        enabled = robots and all(robot.enabled for robot in robots.values())
        if not robots or not (enabled if new else self.run is not None):
            return
        if new and self.run is not None:
            self.run.interrupt("another run started")
            self._armed_by = ""
        elif self.run is not None and message.seal != self.run.seal:
            if message.seal != self._foreign_seal:  # report it once
                self._foreign_seal = message.seal
                what = "horizon ignored: not from the experiment that conducts the run"
                self._report(DiagnosticStatus.WARN, what)
            return
        self._now = nanoseconds_of(message.header.stamp)
        if new:
            start, publish, end = self._now, self.publish, self._server.end
            self.run = Run(message.run, message.seal, start, robots, publish, end)
            self._latest_run = message.run
            self._publish_setup()
        assert self.run is not None
        until = nanoseconds_of(message.until)
        try:
            self.run.take_horizon(self._now, until, last=message.last)
        except LimitError as error:
            self._report(DiagnosticStatus.WARN, f"horizon ignored: {error}")
        except DeviceError as error:
            self.failure = str(error)
        if self.run.closed:
            self.run = None
            self.publish_counts(message.run, until)
        self._report_faults()

    def next_deadline(self) -> float | None:
        """Return when to read a real robot."""
        return self._read_at

    def on_deadline(self) -> None:
        """Promise what a real robot has measured, and report its faults."""
        if not self._robots:
            return
        self._read_at = time.monotonic() + MEASURED_PERIOD
        self._require_signs_of_life()
        try:
            if self.run is not None:
                self.run.look_after()
            else:
                for robot in self._robots.values():
                    robot.read()
        except DeviceError as error:
            self.failure = str(error)
        self._report_faults()


main = Perturbator.main
