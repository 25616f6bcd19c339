# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A walker from outside this project, in the least that the role asks for (docs/person.md).

A metronome: strides of 0.8 s, made up. Put your own source of events in the place of `event_at`.

    ROS_DOMAIN_ID=42 python docs/examples/outside_walker.py
    ROS_DOMAIN_ID=42 entrain run --real-time --walker person --elsewhere gait_detector
"""

import time
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from gait_entrainment_msgs import msg, srv
from gait_entrainment_nodes.messaging.stamps import to_time

STEP, PUSH_OFF = 400_000_000, 100_000_000  # from strike to strike, from strike to toe-off [ns]
LATENCY = 50_000_000  # an event is known this long after its instant [ns]


def event_at(place):
    """Return stamp [ns since the first strike] and what happens there: strikes are 0, 2, 4, ..."""
    step, off = (place + 1) // 2, place % 2
    at = (step - off) * STEP + off * PUSH_OFF
    return at, {"kind": off, "side": (step + 1) % 2, "step": step}


class OutsideWalker(Node):
    """Plays the walker; its node may have any name, the role is in the topics and services."""

    run, sent = 0, 0

    def begin(self, request, response):
        self.run, self.start, self.end = request.run, time.time_ns(), None
        self.place = self.grant = 0
        response.success, response.start = True, to_time(self.start)
        return response

    def hear(self, horizon):
        if horizon.last:  # the experiment has named the end of the run
            self.end = horizon.until.sec * 10**9 + horizon.until.nanosec

    def report(self):
        if not self.run:
            return
        known = max(time.time_ns() - LATENCY, self.start)
        while self.start + (event := event_at(self.place))[0] <= known:
            self.send(msg.GaitEvent, self.start + event[0], uncertainty=0.001, **event[1])
            self.place, self.sent = self.place + 1, self.sent + 1
        final = self.end is not None and known >= self.end
        state = msg.Progress.FINISHED if final else msg.Progress.WALKING
        until = self.end if final else known
        self.send(msg.Progress, until, grant=self.grant, events=self.place, state=state)
        self.grant += 1
        if final:
            counts = {"topics": ["/gait_events"], "counts": [self.sent]}
            self.send(msg.PublishedCounts, until, node="/gait_detector", **counts)
            self.run = 0

    def send(self, message_type, stamp, **fields):
        message = message_type(run=self.run, **fields)
        message.header.stamp = to_time(stamp)
        self.offered[message_type].publish(message)


def answer(_, response):
    """Say that the walker can begin."""
    response.ready, response.now = True, to_time(time.time_ns())
    return response


if __name__ == "__main__":
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        walker = OutsideWalker("outside_walker")
        names = {msg.GaitEvent: "gait_events", msg.Progress: "walker/progress"}
        names[msg.PublishedCounts] = "published_counts"
        walker.offered = {k: walker.create_publisher(k, n, 100) for k, n in names.items()}
        walker.create_subscription(msg.Horizon, "experiment/horizon", walker.hear, 100)
        walker.create_service(srv.StartRun, "walker/start", walker.begin)
        walker.create_service(srv.Ready, "gait_detector/ready", answer)
        walker.create_timer(0.02, walker.report)  # every 20 ms
        rclpy.spin(walker)
