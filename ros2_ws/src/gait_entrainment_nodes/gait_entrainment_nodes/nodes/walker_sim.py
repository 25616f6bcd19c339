# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
walker_sim: the simulated walker, in lock-step or in real time.

walker_sim_run.py decides how far it walks. In lock-step simulated time starts at a fixed time and
the node publishes /clock. In real time what happens at time t is sent at wall time t plus a fixed
delay.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, Side
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.settings import setting
from gait_entrainment_bags.messages import MessageError, nanoseconds_of, profile_of, stop_of
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.srv import StartRun
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.environment import PUNCTUAL
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate
from gait_entrainment_nodes.messaging.stamps import LOCK_STEP_START, START_DELAY, header, to_time
from gait_entrainment_nodes.nodes.participant import Participant
from gait_entrainment_nodes.nodes.walker_run import Stretch, WalkerRun
from gait_entrainment_nodes.nodes.walker_sim_run import LockStepRun, RealTimeRun, Run, Starved

JOINTS = ["l_hip", "r_hip", "l_ankle", "r_ankle"]


@dataclass(frozen=True)
class Settings:
    """Parameters of the node, in addition to those of the walker."""

    seed: int = setting(0, "seed of the variation", "1", (0, 2**32 - 1))
    first_heel_strike: Side = setting(Side.RIGHT, "leg of heel strike 0: left or right")
    sample_rate: float = setting(
        200.0, "rate of the sampled topics; 0: only at gait events", "Hz", (0.0, 1000.0)
    )
    real_time: bool = setting(False, "walk at the pace of the wall clock")
    presentation_delay: float = setting(
        0.0, "real time: wall time of sending minus the stamp", "s", (0.0, 1.0)
    )
    acknowledged: bool = setting(False, "lock-step: wait for the recorder's acknowledgements")
    both_ankles: bool = setting(False, "whether both ankles get torque")
    ground_reaction: bool = setting(True, "publish the ground reaction forces")


class WalkerSim(Participant):
    """ROS side of the walker: parameters, topics, services."""

    settings: Settings
    priority = PUNCTUAL
    walker: WalkerParameters  # the next run starts with it
    variation: Variation
    run: Run | None
    # Where it publishes its gait, which depends on its role.
    events_topic, progress_topic = topics.GAIT_EVENTS, topics.WALKER_PROGRESS

    def __init__(self, name: str = "walker_sim", **more_settings: type) -> None:
        super().__init__(
            name,
            settings=Settings,
            walker=WalkerParameters,
            variation=(Variation, "variation."),
            fixed=("real_time", "acknowledged", "ground_reaction", "sensor"),
            **more_settings,
        )
        self._walked: int | None = None  # number of the run to be reset before the next one
        self._events = self.offer(self.events_topic)
        sampled = [topics.JOINT_STATES, topics.ANKLE_TORQUE]
        if self.settings.ground_reaction:
            sampled += topics.GROUND_REACTION
        self._sampled = [self.offer(topic) for topic in sampled]
        self.offer(self.progress_topic)
        self.offer(topics.WALKER_TIMING)
        if not self.settings.real_time:
            self.offer(topics.CLOCK)
        of_joints = dict.fromkeys(("position", "velocity", "effort"), len(JOINTS))
        self._joints = MessageTemplate(JointState(name=JOINTS), of_joints)
        of_ankles = dict.fromkeys(("intrinsic", "delivered", "effective_perturbation"), 2)
        self._torques = MessageTemplate(msg.AnkleTorque(), of_ankles)
        on_foot = WrenchStamped(header=Header(frame_id="world"))
        self._force = MessageTemplate(on_foot, {"wrench.force.x": 3})
        # A step in advance loads the compiled kernels, for which a run must not wait.
        WalkerRun(self.walker, Side.RIGHT, 100.0).advance(NANOSECONDS_PER_SECOND)
        self.subscribe_to_run(topics.TORQUE_PROFILE, self._on_profile)
        if self.settings.acknowledged and not self.settings.real_time:
            self.subscribe_to_run(topics.RECORDER_PROGRESS, LockStepRun.acknowledge)
        self.offer_start()

    def offer_start(self) -> None:
        """Offer the services of the walker's role."""
        self.create_service(StartRun, "walker/start", self._on_start)
        self.create_service(Trigger, "walker/reset", self._on_reset)

    def _on_start(self, request: StartRun.Request, response: StartRun.Response) -> Any:
        used = self._walked if self.run is None else self.run.number
        waiting = self.not_ready()
        if used is not None:
            response.message = f"run {used} is in progress or ended; reset first"
        elif waiting:
            response.message = f"walker_sim waits for {waiting}"
        else:
            start = time.time_ns() + START_DELAY if self.settings.real_time else LOCK_STEP_START
            self.run = self.new_run(request.run, start)
            self.note_state(DiagnosticStatus.OK, f"run {request.run} is in progress")
            response.success, response.start = True, to_time(self.run.start)
        return response

    def new_run(self, number: int, start: int) -> Run:
        """Return a run with heel strike 0 at ``start`` [ns since 1970]."""
        walker = self.new_walk()
        if not self.settings.real_time:
            return LockStepRun(number, walker, start, acknowledged=self.settings.acknowledged)
        # Deadlines are met on steady time; its offset to the stamps is fixed here, once.
        delay = round(self.settings.presentation_delay * NANOSECONDS_PER_SECOND)
        due_at = time.monotonic_ns() + start - time.time_ns() + delay
        return RealTimeRun(number, walker, start, due_at=due_at)

    def new_walk(self, kind: type[WalkerRun] = WalkerRun, **more: Any) -> WalkerRun:
        """Return the walk of a run; ``more`` are further arguments of its ``kind``."""
        settings = self.settings
        return kind(
            self.walker,
            settings.first_heel_strike,
            settings.sample_rate,
            self.variation,
            settings.seed,
            both_ankles=settings.both_ankles,
            **more,
        )

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        if self.run is not None:
            response.message = f"run {self.run.number} is in progress"
        elif self._walked is not None and not self.settings.real_time:
            # Simulated time would go back to the fixed start, which /clock must never do.
            response.message = (
                "a lock-step run cannot be repeated in one process; restart this node"
            )
        else:
            self._walked, response.success = None, True
        return response

    def _on_profile(self, run: Run, message: msg.TorqueProfile) -> None:
        """Take the torque that the robot promises, or its stop."""
        stop = stop_of(message, run.start)
        if stop is not None:
            run.stop(stop)
            return
        try:
            late = run.promise(profile_of(message, run.start), message.last)
        except MessageError as error:  # another node's; if the robot's, the next does not adjoin
            self.diagnose(run.stamp, DiagnosticStatus.WARN, f"a message is dropped: {error}")
            return
        except ValueError as error:
            reason = f"torque profile {message.revision} cannot be walked: {error}"
            self.failure = "; ".join(filter(None, (reason, self.rivals(topics.TORQUE_PROFILE))))
            return
        if late:
            what = "a torque profile arrived too late: the late part of it was not walked"
            self.diagnose(run.stamp, DiagnosticStatus.WARN, what, late_ms=late / 1e6)

    def next_deadline(self) -> float | None:
        """Return when there is something to walk, on steady time [s]."""
        return None if self.run is None else self.run.due()

    def on_deadline(self) -> None:
        """Walk as far as is allowed and publish the outcome."""
        run = self.run
        assert run is not None
        for walked in run.walk():
            if isinstance(walked, Stretch):
                samples = self.serialized(run, walked)
                run.wait()
                self._send_events(run, walked)
                for publisher, messages in zip(self._sampled, samples, strict=False):
                    publisher.publish_all(messages)
            elif isinstance(walked, Starved):
                what = "no torque profile in time: walking without torque until the next one"
                starved = walked.length / 1e6
                self.diagnose(run.stamp, DiagnosticStatus.WARN, what, starved_ms=starved)
            else:
                self.send_progress(run, walked)

    def on_stop(self) -> None:
        """Report the end of the process if a run is in progress."""
        if self.run is not None:
            self.send_progress(self.run, self.run.progress(aborted=True))

    def _send_events(self, run: Run, stretch: Stretch) -> None:
        for event in stretch.transitions:
            self._events.publish(
                msg.GaitEvent(
                    header=header(run.start + event.stamp),
                    run=run.number,
                    kind=event.kind,
                    side=event.side,
                    step=event.step,
                    source=self.get_name(),
                    detected_at=to_time(run.start + event.stamp),
                )
            )

    def serialized(self, run: Run, stretch: Stretch) -> list[list[bytes]]:
        """Return the messages of the samples of a stretch, by topic; empty if it has none."""
        samples = stretch.samples
        if samples is None:
            return []
        stamps = stretch.sample_times + run.start
        joints = (samples.position, samples.velocity, samples.effort)
        torques = (samples.intrinsic_torque, samples.delivered_torque, samples.effective_torque)
        messages = [self._joints.fill(stamps, *joints), self._torques.fill(stamps, *torques)]
        if self.settings.ground_reaction:
            forces = np.zeros((2, len(stamps), 3))  # (x, y, z) by foot, from (x, z)
            forces[..., ::2] = samples.ground_reaction.swapaxes(0, 1)
            messages += [self._force.fill(stamps, of_foot) for of_foot in forces]
        return messages

    def send_progress(self, run: Run, progress: msg.Progress) -> None:
        """Publish progress, and at the end of a run how it went."""
        self.publish(self.progress_topic, progress)
        if not self.settings.real_time:
            self.publish(topics.CLOCK, ClockMessage(clock=progress.header.stamp))
        if progress.state == msg.Progress.WALKING:
            return
        self.run, self._walked = None, run.number
        timing = run.timing()
        self.publish(topics.WALKER_TIMING, timing)
        level = DiagnosticStatus.OK if progress.reproducible else DiagnosticStatus.WARN
        stamp = nanoseconds_of(progress.header.stamp)
        what = progress.message or "finished"
        names = [n for n in timing.get_fields_and_field_types() if n not in ("header", "run")]
        self.diagnose(stamp, level, what, **{n: getattr(timing, n) for n in names})
        self.publish_counts(run.number, stamp)


main = WalkerSim.main
