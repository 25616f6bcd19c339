# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Driver for any ros2_control robot with an effort controller and a joint state broadcaster.

Torque is published to a controller that takes std_msgs/Float64MultiArray, such as
effort_controllers/JointGroupEffortController; position, velocity and effort of the joint come back
as sensor_msgs/JointState. All of it runs in the torque loop's process, in its own ROS context and
domain, so the robot's names never clash with those of the experiment.

This driver cannot make a controller let go. ros2_control's effort controllers hold their last
command if messages stop, unless the hardware or the controller has its own timeout
(ros2_controllers #95). The conformance kit shows which is the case.
"""

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, nanoseconds_of
from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.settings import setting
from gait_entrainment_drivers.device import Reading, TorqueDevice
from gait_entrainment_drivers.host_timed import HostTimedRobot, LoopOptions
from gait_entrainment_drivers.monitor import SECOND_MASTER
from gait_entrainment_nodes.messaging.client import Client

try:
    from controller_manager_msgs.srv import ListControllers, SwitchController
except ImportError:  # of a full installation
    ListControllers = SwitchController = None

# How long the robot may take to show its joint and its controller [s].
_DISCOVERY_TIMEOUT = 5.0
# How long a request may take [s]: enabling takes two, and the robot's process waits 2 s for it.
_SERVICE_TIMEOUT = 0.8
# How long to wait for a new state before the next command, after the loop was held up [s].
_FRESH_STATE_TIMEOUT = 0.02
_CONTROLLER_GONE = Fault("controller_gone", "No process takes commands: the controller has ended.")
# Only the latest state counts, but other joints may have their own publishers on the topic, whose
# states must not take the place of this one's.
_STATES = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
# Long enough to take a message that has arrived [s].
_NO_TIME = 1e-6
# ros2_control's controllers subscribe as reliable. Only one command is kept, never a queue.
_COMMANDS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)


@dataclass(frozen=True)
class Ros2ControlOptions(LoopOptions):
    """Joint, controller and where they are."""

    joint: str = setting("ankle", "name of the joint in joint_states")
    controller: str = setting("effort_controller", "name of the effort controller")
    joint_states: str = setting("joint_states", "topic of the joint's states")
    namespace: str = setting("", "namespace of the robot, such as /exo")
    domain: int = setting(0, "ROS domain of the robot, not that of the run", "1", (0, 232))
    joint_index: int = setting(0, "index of the joint in the controller's command", "1", (0, 63))
    joint_count: int = setting(1, "joints in the controller's command", "1", (1, 64))
    manage: bool = setting(True, "activate the controller by controller_manager, if available")
    peak_torque: float = setting(20.0, "largest torque at the ankle", "N m", (0.1, 500.0))
    ratio: float = setting(
        1.0,
        "ankle torque per effort of the joint, and joint angle per ankle angle",
        "1",
        (-100.0, 100.0),
    )

    def __post_init__(self) -> None:
        """Check every field, and what no range of a single field covers."""
        super().__post_init__()
        if self.ratio == 0:
            raise LimitError("driver: ratio: 0; allowed: any other number")
        if self.joint_index >= self.joint_count:
            raise LimitError(
                f"driver: joint_index: {self.joint_index}; allowed: below joint_count"
                f" ({self.joint_count})"
            )


class EffortJoint(TorqueDevice):
    """One joint behind an effort controller, as the torque loop sees it."""

    def __init__(self, options: Ros2ControlOptions) -> None:
        self.name = f"joint {options.joint}"
        # A command is for all joints of a controller, so the controller has one master.
        under = f" under {options.namespace.strip('/')}" if options.namespace else ""
        self.address = f"{options.controller}{under} in ROS domain {options.domain}"
        self._options = options
        self.capabilities = options.capabilities(options.peak_torque)
        self._client: Client | None = None  # while the device is open
        self._manager: list[Any] = []  # clients of controller_manager: to list, to switch
        self._state: JointState | None = None  # not read yet
        self._heard = 0  # states of any joints
        self._age = math.inf  # of the joint's last state on arrival [s]
        self._place = 0  # of the joint in that state

    def open(self) -> None:
        """Join the robot's domain, and find its joint and its controller."""
        options = self._options
        named_alike = not options.namespace and options.joint_states == "joint_states"
        if os.environ.get("ROS_DOMAIN_ID", "0") == str(options.domain) and named_alike:
            raise DeviceError(
                f"driver: domain: {options.domain} is that of the run (ROS_DOMAIN_ID), whose "
                "joint_states would mix with the robot's; allowed: another domain, a namespace "
                "for the robot, or another name for its joint_states"
            )
        name, namespace = "gait_entrainment_driver", options.namespace
        self._client = Client(name, namespace=namespace, domain=options.domain)
        self._node = self._client.node
        self._node.create_subscription(JointState, options.joint_states, self._on_state, _STATES)
        self._commands = self._node.create_publisher(
            Float64MultiArray, f"{options.controller}/commands", _COMMANDS
        )
        if options.manage and ListControllers is not None:
            self._manager = [
                self._node.create_client(ListControllers, "controller_manager/list_controllers"),
                self._node.create_client(SwitchController, "controller_manager/switch_controller"),
            ]
        self._wait(
            lambda: self._age < math.inf,
            lambda: f"it is not in {options.joint_states}: start its joint state broadcaster",
        )
        self._wait(
            lambda: self._state is not None,
            lambda: (
                f"its {options.joint_states} are {self._age:.3g} s old on arrival: "
                "synchronize the clocks, and check that the messages are stamped"
            ),
        )
        if self._state is None or not math.isfinite(self._reading(self._state).torque):
            raise DeviceError(f"{self.name} reports no effort: its hardware must export one")
        self._wait(
            lambda: self._commands.get_subscription_count() > 0,
            lambda: (
                f"no node hears {self._commands.topic_name}: load and configure the controller"
            ),
        )

    def enable(self) -> None:
        """Send zero and activate the controller."""
        if SECOND_MASTER in self._watched():
            raise DeviceError(
                f"{self.name}: another node publishes {self._commands.topic_name}: find and stop"
                " it"
            )
        self._publish(0.0)
        self._switch("active")
        self._publish(0.0)

    def exchange(self, torque: float, timeout: float) -> Reading | None:
        """Publish a torque; return the joint's state if a new one arrives within the timeout."""
        self._publish(torque / self._options.ratio)
        self._spin(lambda: self._state is not None, timeout)
        for _ in range(_STATES.depth):  # later ones may have arrived by now
            heard = self._heard
            self._spin(lambda: False, _NO_TIME)
            if self._heard == heard:
                break
        state, self._state = self._state, None
        return None if state is None else self._reading(state)

    def forget(self) -> None:
        """Drop the states received so far, and take one that is measured from now on."""
        now = time.time_ns()
        self._state = None
        self._spin(
            lambda: self._state is not None and nanoseconds_of(self._state.header.stamp) >= now,
            _FRESH_STATE_TIMEOUT,
        )

    def disable(self) -> None:
        """Send zero and deactivate the controller."""
        self._publish(0.0)
        self._switch("inactive")

    def shut(self) -> None:
        """Leave the robot's domain."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _on_state(self, message: JointState) -> None:
        """Take a fresh state that has the joint in it exactly once; ignore others."""
        self._heard += 1
        if list(message.name).count(self._options.joint) != 1:
            return
        self._age = (
            time.time_ns() - nanoseconds_of(message.header.stamp)
        ) / NANOSECONDS_PER_SECOND
        if abs(self._age) < self._options.silence:
            self._place = list(message.name).index(self._options.joint)
            self._state = message

    def _reading(self, state: JointState) -> Reading:
        effort, position, velocity = (
            float(values[self._place]) if len(values) > self._place else math.nan
            for values in (state.effort, state.position, state.velocity)
        )
        ratio = self._options.ratio
        return Reading(effort * ratio, position / ratio, velocity / ratio, faults=self._watched())

    def _watched(self) -> tuple[Fault, ...]:
        """Return the fault of a second master or of a missing controller, if any."""
        if self._node.count_publishers(self._commands.topic_name) > 1:
            return (SECOND_MASTER,)
        return () if self._commands.get_subscription_count() else (_CONTROLLER_GONE,)

    def _publish(self, effort: float) -> None:
        command = [0.0] * self._options.joint_count
        command[self._options.joint_index] = effort
        self._commands.publish(Float64MultiArray(data=command))

    def _spin(self, until: Callable[[], bool], timeout: float) -> bool:
        """Process messages until a condition holds; return whether it does."""
        assert self._client is not None
        return bool(self._client.wait(until, timeout))

    def _wait(self, until: Callable[[], bool], lacking: Callable[[], str]) -> None:
        if not self._spin(until, _DISCOVERY_TIMEOUT):
            raise DeviceError(f"{self.name} of {self.address}: {lacking()}")

    def _switch(self, wanted: str) -> None:
        """Make the controller active or inactive, if controller_manager is available."""
        if not self._manager or not self._spin(self._manager[0].service_is_ready, 0.2):
            return
        listing, switching = self._manager
        name = self._options.controller
        listed = self._answer(listing, ListControllers.Request()).controller
        states = {controller.name: controller.state for controller in listed}
        if name not in states:
            others = ", ".join(states) or "none"
            raise DeviceError(f"controller_manager has no {name}: load it; has: {others}")
        if states[name] == wanted:
            return
        # Only a strict switch reports a controller that cannot be switched as an error.
        request = SwitchController.Request(strictness=SwitchController.Request.STRICT)
        request.timeout.nanosec = NANOSECONDS_PER_SECOND // 2  # so that it answers even then
        if wanted == "active":
            request.activate_controllers = [name]
        else:
            request.deactivate_controllers = [name]
        answer = self._answer(switching, request)
        if not answer.ok:
            raise DeviceError(
                f"controller_manager did not make {name} {wanted}; it is {states[name]}: "
                f"{' '.join(answer.message.split()) or 'is it configured, and its joint free?'}"
            )

    def _answer(self, client: Any, request: Any) -> Any:
        future = client.call_async(request)
        if not self._spin(future.done, _SERVICE_TIMEOUT):
            raise DeviceError("controller_manager does not answer: check that it is running")
        return future.result()


class Ros2ControlRobot(HostTimedRobot):
    """See the module's docstring; docs/drivers.md has a worked example."""

    Options = Ros2ControlOptions
    Device = EffortJoint
