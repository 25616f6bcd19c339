# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
walker_sim: the simulated walker, in lock-step or in real time.

It never computes past the last promise of the perturbator. In lock-step every promised stretch
is computed and sent at once; in real time the instant t is sent at wall time t plus a fixed
delay, and a stretch for which no promise came in time is walked without torque and counted.
"""

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.robot import TorqueProfile
from gait_entrainment.walker import Stretch, WalkerRun
from gait_entrainment_msgs.msg import AnkleTorque, GaitEvent, Progress
from gait_entrainment_msgs.msg import TorqueProfile as TorqueProfileMessage
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate, mark
from gait_entrainment_nodes.messaging.stamps import header, to_nanoseconds, to_time
from gait_entrainment_nodes.messaging.topics import (
    ANKLE_TORQUE,
    CLOCK,
    GAIT_EVENTS,
    GROUND_REACTION,
    JOINT_STATES,
    RECORDER_PROGRESS,
    TORQUE_PROFILE,
    WALKER_PROGRESS,
)
from gait_entrainment_nodes.nodes.lateness import Lateness
from gait_entrainment_nodes.nodes.node import (
    Participant,
    declare,
    declare_fields,
    declare_side,
    fields_of,
    run_node,
    side_of,
)

JOINTS = ["l_hip", "r_hip", "l_ankle", "r_ankle"]
# Heel strike 0 of a lock-step run [s since 1970]: 2000-01-01, plainly not a recording time.
LOCK_STEP_START = 946_684_800
# Grants that may be sent before the recorder has acknowledged the first of them: two let it
# write one while the next is computed.
UNACKNOWLEDGED_GRANTS = 2
# Real time: how often progress is reported and promises are asked for [ns].
PROGRESS_PERIOD = 20_000_000
# Real time: from the start request to heel strike 0 [ns], so that the first promise is there.
START_DELAY = 200_000_000


class WalkerSim(Participant, Node):
    """ROS side of the walker: parameters, topics, pacing. See the module's docstring."""

    def __init__(self) -> None:
        super().__init__("walker_sim")
        declare_fields(self, WalkerParameters)
        declare_side(self, "first_heel_strike", "leg of heel strike 0: left or right")
        declare(
            self,
            "sample_rate",
            200.0,
            "rate of the sampled topics; 0 samples at gait events only",
            unit="Hz",
            within=(0.0, 1000.0),
            read_only=False,
        )
        self.real_time = declare(self, "real_time", False, "pace by the wall clock")
        declare(
            self,
            "presentation_delay",
            0.0,
            "real time: wall time minus the instant that is sent",
            unit="s",
            within=(0.0, 1.0),
            read_only=False,
        )
        self.acknowledged = declare(
            self, "acknowledged", False, "lock-step: keep to what a recorder has acknowledged"
        )
        with_forces = declare(self, "ground_reaction", True, "publish the ground reaction forces")
        self.run: WalkerRun | None = None
        self.begin_participation()

        self.events = self.publisher(GAIT_EVENTS)
        self.joint_states = self.publisher(JOINT_STATES)
        self.ankle_torque = self.publisher(ANKLE_TORQUE)
        self.forces = [self.publisher(t) for t in GROUND_REACTION] if with_forces else []
        self.progress = self.publisher(WALKER_PROGRESS)
        self.clock_publisher = None if self.real_time else self.publisher(CLOCK)
        self._make_templates()
        # A step ahead of time loads the compiled kernels, which the first stretch must not wait
        # for.
        WalkerRun(self.parameters, self.first_heel_strike, 100.0).advance(NANOSECONDS_PER_SECOND)

        self.begin_run(0)
        self.subscription(TORQUE_PROFILE, self.on_profile)
        if self.acknowledged and not self.real_time:
            self.subscription(RECORDER_PROGRESS, self.on_acknowledgement)
        self.create_service(StartRun, "~/start", self.on_start)
        self.create_service(Trigger, "~/reset", self.on_reset)

    # Parameters: the next run begins with them

    def why_fixed(self, name: str) -> str:
        """Return why a parameter cannot change now: a run goes on."""
        del name
        going_on = self.run is not None and not self.run.ended
        return f"run {self.run_number} goes on; change it between runs" if going_on else ""

    def take_parameters(self, value: Callable[[str], Any]) -> None:
        """Take the walker and how it is sampled."""
        parameters = fields_of(WalkerParameters, value)
        self.first_heel_strike = side_of("first_heel_strike", value)
        self.parameters = parameters
        self.sample_rate = value("sample_rate")
        self.presentation_delay = value("presentation_delay")

    # Start, reset

    def begin_run(self, run: int) -> None:
        """Forget the run before."""
        self.run_number = run
        self.start = 0  # instant of heel strike 0 [ns since 1970]
        self.steady_offset = 0  # steady time at which instant 0 is due [ns]
        self.grant = 0
        self.acknowledged_grants = 0
        self.granted: deque[tuple[int, bool]] = deque()  # lock-step: (until, last), not yet walked
        self.end_of_run: int | None = None  # end of the run [ns since its start], once known
        self.reproducible = True
        self.late = 0  # [ns] of promises that came after their instant
        self.late_stretches = self.starved_stretches = 0  # how many there were of each
        self.starving = False  # the stretch walked last had no promise
        self.lateness = Lateness()  # real time: of samples, from due to published
        self.next_progress = 0  # [ns since the start]

    def on_start(self, request: StartRun.Request, response: StartRun.Response) -> Any:
        """Start a run, once, after which the walker follows the promises."""
        if self.run is not None:
            response.message = f"run {self.run_number} is in progress or ended; reset first"
            return response
        waiting = self.not_ready()
        if waiting:
            response.message = f"walker_sim waits for {waiting}"
            return response
        self.run = WalkerRun(self.parameters, self.first_heel_strike, self.sample_rate)
        self.begin_run(request.run)
        if self.real_time:
            self.start = time.time_ns() + START_DELAY
            # Deadlines are met on steady time; its offset to the stamps is fixed here, once.
            delay = START_DELAY + round(self.presentation_delay * NANOSECONDS_PER_SECOND)
            self.steady_offset = time.monotonic_ns() + delay
        else:
            self.start = LOCK_STEP_START * NANOSECONDS_PER_SECOND
        self.note_state(DiagnosticStatus.OK, f"run {request.run} goes on")
        response.success, response.start = True, to_time(self.start)
        return response

    def on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        """Make ready for another run; refused while one goes on."""
        if self.run is not None and not self.run.ended:
            response.message = f"run {self.run_number} is in progress"
        elif self.run is not None and not self.real_time:
            # Simulated time would go back to the fixed start, which /clock must never do.
            response.message = "a lock-step run cannot be repeated in one process; start anew"
        else:
            self.run, response.success = None, True
        return response

    # Promises and acknowledgements

    def on_profile(self, message: TorqueProfileMessage) -> None:
        """Take what the robot promises to deliver."""
        run = self.run
        if run is None or message.run != self.run_number or run.ended:
            return
        if message.stop:
            run.stop(to_nanoseconds(message.header.stamp) - self.start)
            self.reproducible = False
            return
        until = to_nanoseconds(message.valid_until) - self.start
        times = tuple(to_nanoseconds(t) - self.start for t in message.times)
        late = 0
        # A profile without length only says where the run ends.
        if times != (until,):
            try:
                late = run.accept(
                    TorqueProfile(Side(message.side), times, tuple(message.torques), (), until)
                )
            except (ValueError, IndexError) as error:
                self.failure = f"torque profile {message.revision} cannot be walked: {error}"
                return
        if late:
            self.late += late
            self.late_stretches += 1
            self.reproducible = False
            self.diagnose(
                self.start + run.reached,
                DiagnosticStatus.WARN,
                "a torque profile came after its instant: that part of it was not walked",
                late_ms=late / 1e6,
            )
        if self.real_time:
            # Where the last promise comes late, its end is already past.
            self.end_of_run = max(until, run.reached) if message.last else None
        else:
            self.granted.append((until, message.last))
            self.walk_granted()

    def on_acknowledgement(self, message: Progress) -> None:
        """Take the recorder's word that it holds everything up to a grant."""
        if message.run == self.run_number:
            self.acknowledged_grants = message.grant + 1
            self.walk_granted()

    # Lock-step

    def walk_granted(self) -> None:
        """Walk every promised stretch, as far as the recorder keeps up."""
        run = self.run
        while run is not None and self.granted and not run.ended:
            if (
                self.acknowledged
                and self.grant - self.acknowledged_grants >= UNACKNOWLEDGED_GRANTS
            ):
                return
            until, last = self.granted.popleft()
            self.send(run.advance(until, last=last))
            self.report_progress(run)

    # Real time

    def next_deadline(self) -> float | None:
        """Return when the next sample, progress report or the end is due, on steady time [s]."""
        run = self.run
        if run is None or not self.real_time or run.ended:
            return None
        due = min(run.next_sample, self.next_progress)
        if self.end_of_run is not None:
            due = min(due, self.end_of_run)
        return (self.steady_offset + due) / NANOSECONDS_PER_SECOND

    def on_deadline(self) -> None:
        """Send everything that is due by now, each sample with its exact stamp."""
        run = self.run
        assert run is not None
        now = time.monotonic_ns() - self.steady_offset
        if now < 0:
            return
        end = self.end_of_run
        last = end is not None and now >= end
        until = now if end is None else min(now, end)
        starved = run.starved
        self.send(run.advance(until, last=last))
        starving, self.starving = self.starving, run.starved > starved
        if self.starving and not starving:
            self.starved_stretches += 1
            self.reproducible = False
            self.diagnose(
                self.start + run.reached,
                DiagnosticStatus.WARN,
                "no torque profile in time: from here to the next one it is walked without torque",
                starved_ms=(run.starved - starved) / 1e6,
            )
        if now >= self.next_progress or run.ended:
            self.next_progress = now - now % PROGRESS_PERIOD + PROGRESS_PERIOD
            self.report_progress(run)

    # Sending

    def send(self, stretch: Stretch) -> None:
        """Publish the events and samples of one stretch."""
        for event in stretch.transitions:
            self.events.publish(
                GaitEvent(
                    header=header(self.start + event.stamp),
                    run=self.run_number,
                    kind=event.kind,
                    side=event.side,
                    step=event.step,
                    source="walker_sim",
                )
            )
        samples = stretch.samples
        if samples is None:
            return
        stamps = stretch.sample_times + self.start
        for publisher, messages in (
            (
                self.joint_states,
                self._joint_template.fill(
                    stamps,
                    position=samples.position,
                    velocity=samples.velocity,
                    effort=samples.effort,
                ),
            ),
            (
                self.ankle_torque,
                self._torque_template.fill(
                    stamps,
                    intrinsic=samples.intrinsic_torque,
                    delivered=samples.delivered_torque,
                    effective=samples.effective_torque,
                ),
            ),
            *(
                (publisher, self._force_template.fill(stamps, force=force))
                for publisher, force in zip(
                    self.forces,
                    np.moveaxis(_in_space(samples.ground_reaction), 1, 0),
                    strict=False,
                )
            ),
        ):
            for message in messages:
                publisher.publish(message)
        if self.real_time:
            published = time.monotonic_ns() - self.steady_offset
            for instant in stretch.sample_times:
                self.lateness.add((published - int(instant)) / NANOSECONDS_PER_SECOND)

    def report_progress(self, run: WalkerRun, aborted: bool = False) -> None:
        """Tell how far everything has been sent; at the end of a run, how it ended."""
        stamp = self.start + run.reached
        message = Progress(
            header=header(stamp),
            run=self.run_number,
            grant=self.grant,
            events=run.events,
            samples=run.samples,
            reproducible=self.reproducible,
        )
        if run.ending is not None:
            message.state = Progress.FELL if run.ending.kind == "fall" else Progress.FLEW_OFF
            message.message = run.ending.message
        elif aborted:
            message.state = Progress.ABORTED
            message.message = "walker_sim was shut down"
        elif run.ended:
            message.state = Progress.FINISHED
        self.progress.publish(message)
        if self.clock_publisher is not None:
            self.clock_publisher.publish(ClockMessage(clock=to_time(stamp)))
        self.grant += 1
        if message.state != Progress.WALKING:
            self.diagnose(
                stamp,
                DiagnosticStatus.OK if self.reproducible else DiagnosticStatus.WARN,
                message.message or "finished",
                late_stretches=self.late_stretches,
                late_ms=self.late / 1e6,
                starved_stretches=self.starved_stretches,
                starved_ms=run.starved / 1e6,
                **self.publish_lateness(),
            )
            self.publish_counts(self.run_number, stamp)

    def publish_lateness(self) -> dict[str, float]:
        """Return how late samples were published, from the instant at which they were due."""
        late = self.lateness
        if not late.count:
            return {}
        quantiles = {"p50": late.quantile(0.5), "p99": late.quantile(0.99), "worst": late.worst}
        return {f"publish_late_{name}_ms": 1e3 * value for name, value in quantiles.items()}

    def on_stop(self) -> None:
        """End of the process: say so where a run goes on."""
        if self.run is not None and not self.run.ended:
            self.report_progress(self.run, aborted=True)

    def _make_templates(self) -> None:
        marked = [[mark(i), 0.0, 0.0, 0.0] for i in range(3)]
        self._joint_template = MessageTemplate(
            JointState(name=JOINTS, position=marked[0], velocity=marked[1], effort=marked[2]),
            {"position": 4, "velocity": 4, "effort": 4},
        )
        pairs = [[mark(i), 0.0] for i in range(3)]
        self._torque_template = MessageTemplate(
            AnkleTorque(intrinsic=pairs[0], delivered=pairs[1], effective_perturbation=pairs[2]),
            {"intrinsic": 2, "delivered": 2, "effective": 2},
        )
        force = WrenchStamped()
        force.header.frame_id = "world"
        force.wrench.force.x = mark(0)
        self._force_template = MessageTemplate(force, {"force": 3})


def _in_space(forces: np.ndarray) -> np.ndarray:
    """Return sagittal force vectors (x, z), shape (n, 2, 2), as (x, y, z), shape (n, 2, 3)."""
    return np.insert(forces, 1, 0.0, axis=-1)


def main() -> int:
    """Run the node."""
    return run_node(WalkerSim)
