# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A walker from outside this project, with the minimum that the role requires (docs/person.md).

It is a metronome with made-up strides of 0.8 s. Replace `event_at` with your own source of events.

    ROS_DOMAIN_ID=42 python docs/examples/outside_walker.py
    ROS_DOMAIN_ID=42 entrain run --real-time --walker person --elsewhere walker
"""

import time
from contextlib import suppress

import rclpy.node

from gait_entrainment_msgs import msg, srv
from gait_entrainment_nodes.messaging.stamps import header, to_time

# From strike to strike, from strike to toe-off, and until an event is known [ns].
STEP, PUSH_OFF, LATENCY = 400_000_000, 100_000_000, 50_000_000


def event_at(place):
    """Return stamp [ns since the first strike] and fields of an event: strikes are 0, 2, 4, ..."""
    step, off = (place + 1) // 2, place % 2
    at = (step - off) * STEP + off * PUSH_OFF
    return at, {"kind": off, "side": (step + 1) % 2, "step": step, "uncertainty": 0.001}


class OutsideWalker(rclpy.node.Node):
    """Plays the walker; the node may have any name, as topics and service define the role."""

    def __init__(self):
        super().__init__("outside_walker")
        self.events = self.create_publisher(msg.GaitEvent, "gait_events", 100)
        self.progress = self.create_publisher(msg.Progress, "walker/progress", 100)
        self.create_subscription(msg.Horizon, "experiment/horizon", self.hear, 100)
        self.create_service(srv.StartRun, "walker/start", self.begin)

    def begin(self, request, response):
        self.run, self.start, self.end, self.place = request.run, time.time_ns(), 2**62, 0
        self.timer = self.create_timer(0.02, self.report)  # every 20 ms
        response.success, response.start = True, to_time(self.start)
        return response

    def hear(self, horizon):
        if horizon.last:  # the end of the run, unknown until now
            self.end = horizon.until.sec * 10**9 + horizon.until.nanosec

    def report(self):
        known = min(max(time.time_ns() - LATENCY, self.start), self.end)
        while (event := event_at(self.place))[0] <= known - self.start:
            stamp = header(self.start + event[0])
            self.events.publish(msg.GaitEvent(header=stamp, run=self.run, **event[1]))
            self.place += 1
        report = msg.Progress(header=header(known), run=self.run, events=self.place)
        if known == self.end:
            report.state = msg.Progress.FINISHED
            self.destroy_timer(self.timer)
        self.progress.publish(report)


if __name__ == "__main__":
    rclpy.init()
    with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.spin(OutsideWalker())
