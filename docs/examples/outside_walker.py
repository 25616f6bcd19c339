# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A walker from outside this project, in the least that the role asks for (docs/person.md).

A metronome: strides of 0.8 s, made up. Put your own source of events in the place of `event_at`.

    ROS_DOMAIN_ID=42 python docs/examples/outside_walker.py
    ROS_DOMAIN_ID=42 entrain run --real-time --walker person --elsewhere gait_detector
"""

import contextlib
import time

import rclpy
import rclpy.executors

from gait_entrainment_msgs.msg import GaitEvent, Horizon, Progress, PublishedCounts
from gait_entrainment_msgs.srv import Ready, StartRun
from gait_entrainment_nodes.messaging.stamps import to_time

STEP, PUSH_OFF = 400_000_000, 100_000_000  # from strike to strike, from strike to toe-off [ns]
LATENCY = 50_000_000  # an event is known this long after its instant [ns]


def event_at(place):
    """Return stamp [ns since the first strike] and what happens there: strikes are 0, 2, 4, ..."""
    step = (place + 1) // 2
    off = place % 2
    at = (step - off) * STEP + off * PUSH_OFF
    return at, {"kind": off, "side": (step + 1) % 2, "step": step}


class OutsideWalker:
    """Plays the walker; its node may have any name, the role is in the topics and services."""

    def __init__(self, node):
        self.run, self.sent = 0, 0
        self.events = node.create_publisher(GaitEvent, "gait_events", 100)
        self.progress = node.create_publisher(Progress, "walker/progress", 100)
        self.counts = node.create_publisher(PublishedCounts, "published_counts", 100)
        node.create_subscription(Horizon, "experiment/horizon", self.hear, 100)
        node.create_service(StartRun, "walker/start", self.begin)
        node.create_service(Ready, "gait_detector/ready", self.answer)
        node.create_timer(0.02, self.report)  # every 20 ms

    def answer(self, _, response):
        response.ready, response.now = True, to_time(time.time_ns())
        return response

    def begin(self, request, response):
        self.run, self.end, self.place, self.grant = request.run, None, 0, 0
        self.start = time.time_ns()
        response.success, response.start = True, to_time(self.start)
        return response

    def hear(self, horizon):
        if horizon.last:  # the experiment has named the end of the run
            self.end = horizon.until.sec * 10**9 + horizon.until.nanosec

    def report(self):
        if not self.run:
            return
        known = time.time_ns() - LATENCY
        while self.start + (event := event_at(self.place))[0] <= known:
            message = GaitEvent(run=self.run, source="metronome", uncertainty=0.001, **event[1])
            message.header.stamp = to_time(self.start + event[0])
            self.events.publish(message)
            self.place, self.sent = self.place + 1, self.sent + 1
        final = self.end is not None and known >= self.end
        told = Progress(run=self.run, grant=self.grant, events=self.place, reproducible=True)
        told.header.stamp = to_time(max(self.end if final else known, self.start))
        told.state = Progress.FINISHED if final else Progress.WALKING
        self.grant += 1
        self.progress.publish(told)
        if final:
            counts = PublishedCounts(run=self.run, node="/gait_detector", header=told.header)
            counts.topics, counts.counts = ["/gait_events"], [self.sent]
            self.counts.publish(counts)
            self.run = 0


if __name__ == "__main__":
    rclpy.init()
    walker = rclpy.create_node("outside_walker")
    OutsideWalker(walker)
    with contextlib.suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.spin(walker)
