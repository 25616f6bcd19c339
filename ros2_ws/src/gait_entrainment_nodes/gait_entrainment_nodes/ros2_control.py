# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Driver of any robot that speaks ros2_control: an effort controller and a joint state broadcaster.

Torque is published to a controller that takes std_msgs/Float64MultiArray, such as
effort_controllers/JointGroupEffortController; position, velocity and effort of the joint come back
as sensor_msgs/JointState. All of it runs in the torque loop's process, in a ROS context and domain
of its own: the robot's names never meet those of the experiment.

What this cannot do: make a controller let go. ros2_control's effort controllers hold their last
command if messages stop, unless the hardware or the controller has a timeout of its own
(ros2_controllers #95). The conformance kit proves which it is.
"""

import math
import os
import time
from dataclasses import dataclass
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from gait_entrainment.robot.contract import Capabilities
from gait_entrainment.robot.faults import DeviceError
from gait_entrainment.settings import setting
from gait_entrainment_drivers.device import Reading, TorqueDevice
from gait_entrainment_drivers.host_timed import HostTimedRobot, LoopOptions

# How long the robot may take to show its joint, its controller and its services [s].
_DISCOVERY_TIMEOUT = 5.0
_SERVICE_TIMEOUT = 2.0
# Only the latest state counts.
_STATES = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# What ros2_control's controllers subscribe with is reliable. One command is kept: never a queue.
_COMMANDS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)


@dataclass(frozen=True)
class Ros2ControlOptions(LoopOptions):
    """Joint, controller and where they are."""

    joint: str = setting("ankle", "name of the joint in joint_states")
    controller: str = setting("effort_controller", "name of the effort controller")
    joint_states: str = setting("joint_states", "topic of the joint's states")
    namespace: str = setting("", "of the robot, such as /exo")
    domain: int = setting(0, "ROS domain of the robot; not that of the run", "1", (0, 232))
    joint_index: int = setting(0, "place of the joint in the controller's command", "1", (0, 63))
    joint_count: int = setting(1, "joints in the controller's command", "1", (1, 64))
    manage: bool = setting(True, "activate the controller by controller_manager, if it is there")
    peak_torque: float = setting(20.0, "largest torque of the joint", "N m", (0.1, 500.0))
    ratio: float = setting(1.0, "ankle torque per joint effort", "1", (-100.0, 100.0))

    def __post_init__(self) -> None:
        """Check every field, and what has no range of its own."""
        super().__post_init__()
        if self.ratio == 0:
            raise DeviceError("driver: ratio: 0; allowed: any other number")
        if self.joint_index >= self.joint_count:
            raise DeviceError(
                f"driver: joint_index: {self.joint_index}; allowed: below joint_count"
                f" ({self.joint_count})"
            )


class EffortJoint(TorqueDevice):
    """One joint behind an effort controller, as the torque loop sees it."""

    def __init__(self, options: Ros2ControlOptions) -> None:
        self.name = f"joint {options.joint}"
        self._options = options
        self.capabilities = Capabilities(
            peak_torque=options.peak_torque,
            torque_rate=math.inf,
            measures_torque=True,
            simulated=False,
            state_rate=options.rate,
            torque_bandwidth=options.bandwidth,
        )
        self._node: Any = None
        self._state: JointState | None = None  # not read yet
        self._place = 0  # of the joint in it

    def open(self) -> None:
        """Join the robot's domain, and see its joint and its controller."""
        options = self._options
        if os.environ.get("ROS_DOMAIN_ID", "0") == str(options.domain) and not options.namespace:
            raise DeviceError(
                f"driver: domain: {options.domain} is that of the run, whose joint_states would "
                "meet the robot's; allowed: another domain, or a namespace of the robot"
            )
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=options.domain)
        self._node = Node(
            "gait_entrainment_driver",
            context=self._context,
            namespace=options.namespace or None,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(JointState, options.joint_states, self._on_state, _STATES)
        self._commands = self._node.create_publisher(
            Float64MultiArray, f"{options.controller}/commands", _COMMANDS
        )
        self._wait(lambda: self._state is not None, f"no {options.joint_states} with the joint")
        if not math.isfinite(self._effort()):
            raise DeviceError(f"{self.name} reports no effort: its hardware must export one")

    def enable(self) -> None:
        """Send zero, activate the controller, and see that it listens."""
        options = self._options
        self._publish(0.0)
        if options.manage:
            self._switch(activate=True)
        self._wait(
            lambda: self._commands.get_subscription_count() > 0,
            f"nobody listens to {options.controller}/commands: load and activate the controller",
        )
        self._publish(0.0)

    def exchange(self, torque: float, patience: float) -> Reading | None:
        """Publish a torque; return the joint's state if a new one came meanwhile."""
        self._publish(torque / self._options.ratio)
        give_up = time.monotonic() + patience
        while (left := give_up - time.monotonic()) > 0 and self._state is None:
            self._executor.spin_once(timeout_sec=left)
        state, self._state = self._state, None
        if state is None:
            return None
        ratio = self._options.ratio
        return Reading(
            state.effort[self._place] * ratio,
            self._of(state.position) / ratio,
            self._of(state.velocity) / ratio,
        )

    def disable(self) -> None:
        """Send zero and deactivate the controller."""
        self._publish(0.0)
        if self._options.manage:
            self._switch(activate=False)

    def shut(self) -> None:
        """Leave the robot's domain."""
        if self._node is None:
            return
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)
        self._node = None

    def _on_state(self, message: JointState) -> None:
        """Take a state that has the joint in it; those of other joints are nobody's business."""
        if self._options.joint in message.name:
            self._place = list(message.name).index(self._options.joint)
            if len(message.effort) > self._place:
                self._state = message

    def _of(self, values: Any) -> float:
        return float(values[self._place]) if len(values) > self._place else math.nan

    def _effort(self) -> float:
        return math.nan if self._state is None else self._of(self._state.effort)

    def _publish(self, effort: float) -> None:
        command = [0.0] * self._options.joint_count
        command[self._options.joint_index] = effort
        self._commands.publish(Float64MultiArray(data=command))

    def _wait(self, condition: Any, lacking: str, timeout: float = _DISCOVERY_TIMEOUT) -> None:
        give_up = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > give_up:
                options = self._options
                raise DeviceError(
                    f"{self.name}: {lacking} in domain {options.domain}"
                    f"{options.namespace and ' under ' + options.namespace}"
                )
            self._executor.spin_once(timeout_sec=0.01)

    def _switch(self, *, activate: bool) -> None:
        """Activate or deactivate the controller, if controller_manager can be asked."""
        try:
            from controller_manager_msgs.srv import SwitchController  # of a full installation
        except ImportError:
            return
        client = self._node.create_client(SwitchController, "controller_manager/switch_controller")
        if not client.wait_for_service(timeout_sec=0.2):
            return
        request = SwitchController.Request(strictness=SwitchController.Request.STRICT)
        wanted = [self._options.controller]
        if activate:
            request.activate_controllers = wanted
        else:
            request.deactivate_controllers = wanted
        future = client.call_async(request)
        self._wait(future.done, "controller_manager does not answer", _SERVICE_TIMEOUT)
        if activate and not future.result().ok:
            raise DeviceError(
                f"controller_manager does not activate {self._options.controller}: is it loaded, "
                "and is its joint free?"
            )


class Ros2ControlRobot(HostTimedRobot):
    """See the module's docstring; docs/drivers.md has a worked example."""

    Options = Ros2ControlOptions
    Device = EffortJoint
