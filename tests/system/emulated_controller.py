# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A robot under ros2_control as the driver sees it: an effort controller, a state broadcaster.

    python emulated_controller.py DOMAIN [--timeout S] [--namespace NAME] ...

The torque follows the command with a lag of 30 Hz. Without a timeout the last command is held, as
in ros2_control's effort controllers. With --manager NAME=STATE, a controller_manager with Jazzy's
service types answers a strict switch as Jazzy's does. Prints a line when it is ready.
"""

import argparse
import contextlib
import math
import os
import time
from pathlib import Path

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray


class Controller(Node):
    """Two joints, knee and ankle; only the ankle is driven."""

    def __init__(self, options):
        super().__init__("controller_manager", namespace=options.namespace)
        self.options = options
        self.command = self.torque = 0.0
        self.heard_at = self.now = time.monotonic()
        self.states = self.create_publisher(JointState, options.joint_states, 1)
        self.name, _, self.state = options.manager.partition("=")
        if options.manager:
            self.manage()
        if not options.deaf:
            topic = "effort_controller/commands"
            self.create_subscription(Float64MultiArray, topic, self.on_command, 1)

    def manage(self):
        from controller_manager_msgs.srv import ListControllers, SwitchController

        self.create_service(ListControllers, "~/list_controllers", self.list)
        if not self.options.silent:
            self.create_service(SwitchController, "~/switch_controller", self.switch)

    def list(self, _, response):
        from controller_manager_msgs.msg import ControllerState

        response.controller = [ControllerState(name=self.name, state=self.state)]
        return response

    def switch(self, request, response):
        assert request.strictness == request.STRICT
        (name,) = [*request.activate_controllers, *request.deactivate_controllers]
        before = "inactive" if request.activate_controllers else "active"
        response.ok = (name, self.state) == (self.name, before)
        if response.ok:
            self.state = "active" if request.activate_controllers else "inactive"
        else:
            response.message = f"Controller with name '{name}' is in '{self.state}' state.\n"
        self.command = 0.0
        with self.options.trace.open("a") as trace:
            trace.write(f"{self.state}\n")
        return response

    def on_command(self, message):
        self.advance()
        (command,) = message.data
        self.command = command if self.state in ("", "active") else 0.0
        self.heard_at = self.now

    def advance(self):
        now = time.monotonic()
        if self.options.timeout and now - self.heard_at > self.options.timeout:
            self.command = 0.0
        decay = math.exp(-2 * math.pi * 30.0 * (now - self.now))
        self.torque = self.command + (self.torque - self.command) * decay
        self.now = now

    def publish_state(self):
        self.advance()
        message = JointState(name=["knee", "ankle"], position=[1.0, 0.1], velocity=[0.0, 0.0])
        stamp = time.time_ns() - round(self.options.behind * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        message.effort = [] if self.options.no_effort else [math.nan, self.torque]
        self.states.publish(message)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain", type=int)
    parser.add_argument("--timeout", type=float, default=0.0)
    parser.add_argument("--rate", type=float, default=500.0)
    parser.add_argument("--namespace", default="")
    parser.add_argument("--joint-states", default="joint_states")
    parser.add_argument("--behind", type=float, default=0.0, help="lag of its clock [s]")
    parser.add_argument("--manager", default="", metavar="NAME=STATE", help="its controller")
    parser.add_argument("--trace", type=Path, default=os.devnull, help="states switched to")
    parser.add_argument("--silent", action="store_true", help="no service to switch")
    parser.add_argument("--deaf", action="store_true", help="no controller")
    parser.add_argument("--no-effort", action="store_true", help="no torque is measured")
    options = parser.parse_args()
    rclpy.init(args=[], domain_id=options.domain)
    node = Controller(options)
    executor = EventsExecutor()
    executor.add_node(node)
    for thread in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # it emulates hardware, which waits for no process
            os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, os.sched_param(60))
    print("ready", flush=True)
    due = time.monotonic()
    while True:
        node.publish_state()
        due += 1 / options.rate
        while (left := due - time.monotonic()) > 0:
            executor.spin_once(timeout_sec=left)


if __name__ == "__main__":
    main()
