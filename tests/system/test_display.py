# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""walker_display draws the walker at the time of its samples, and no node waits for it."""

import cmath
import math
import signal
import xml.etree.ElementTree as ElementTree
from itertools import pairwise

import pytest
from harness import QUICK, protocol_of, session, stamp_of
from visualization_msgs.msg import Marker

from gait_entrainment.conventions import EventKind
from gait_entrainment_bringup.node_list import DISPLAY, NODES
from gait_entrainment_msgs.action import RunProtocol
from gait_entrainment_nodes.messaging.topics import (
    ANKLE_TORQUE,
    GAIT_EVENTS,
    JOINT_STATES,
    MARKERS,
    ROBOT_DESCRIPTION,
    TF,
    WALKER_PROGRESS,
)

# The pulses begin before toe-off and end after it.
WALK = (*QUICK, "--baseline=2", "--pulses=2", "--washout=0", "--initial-phase=0.655")
SCALE = 0.035


def turned(transform):
    """Return the angle about y of a transform that turns about y only."""
    q = transform.transform.rotation
    assert q.x == q.z == 0
    return 2 * math.atan2(q.y, q.w)


def arc_angle(marker):
    """Return the angle from start to tip of an arc around the ankle."""
    directions = [complex(p.z, p.x) for p in marker.points[:-3]]
    return sum(cmath.phase(after / before) for before, after in pairwise(directions))


def test_pictures_agree_with_the_samples_of_the_same_stamp(tmp_path):
    with session(tmp_path, *WALK, nodes=(*NODES, DISPLAY)) as nodes:
        topics = (JOINT_STATES, ANKLE_TORQUE, GAIT_EVENTS, TF, MARKERS, ROBOT_DESCRIPTION)
        heard = {topic.name: nodes.probe.listen(topic) for topic in topics}
        result = nodes.probe.result(nodes.conduct()).result
        assert result.outcome == RunProtocol.Result.FINISHED, result.message
        nodes.probe.until(
            lambda: (
                heard[TF.name]
                and heard[MARKERS.name]
                and stamp_of(heard[TF.name][-1].transforms[0].header)
                == stamp_of(heard[MARKERS.name][-1].markers[0].header)
            ),
            "the last picture",
        )
    # Late subscribers get the description as well.
    (description,) = heard[ROBOT_DESCRIPTION.name]
    assert ElementTree.fromstring(description.data).get("name") == "sagittal_walker"

    states = {stamp_of(m.header): m for m in heard[JOINT_STATES.name]}
    torques = {stamp_of(m.header): m for m in heard[ANKLE_TORQUE.name]}
    strikes = [
        stamp_of(m.header) for m in heard[GAIT_EVENTS.name] if m.kind == EventKind.HEEL_STRIKE
    ]
    bodies = {stamp_of(m.transforms[0].header): m.transforms for m in heard[TF.name]}
    assert len(bodies) > 40
    step_length = protocol_of(*WALK).walker.step_length
    for stamp, transforms in bodies.items():
        by_child = {t.child_frame_id: t for t in transforms}
        position = dict(zip(states[stamp].name, states[stamp].position, strict=True))
        for side in ("l", "r"):
            assert -turned(by_child[f"{side}_leg"]) == pytest.approx(
                position[f"{side}_hip"], abs=1e-12
            )
            assert turned(by_child[f"{side}_sole"]) == pytest.approx(
                position[f"{side}_ankle"], abs=1e-12
            )
        # One foot stands where the last heel strike was.
        x = by_child["base_footprint"].transform.translation.x
        heel = step_length * (sum(strike <= stamp for strike in strikes) - 1)
        lean = [position["l_hip"], position["r_hip"]]
        assert min(abs(x + math.sin(hip) - heel) for hip in lean) < 1e-6

    seen = set()  # whether each drawn pulse acts
    for drawn in heard[MARKERS.name]:
        stamp = stamp_of(drawn.markers[0].header)
        assert stamp in bodies
        for marker in drawn.markers:
            assert marker.header.frame_id == ("l_leg", "r_leg")[marker.id]
            assert marker.pose.position.z == -1.0  # the leg's length: at the ankle
            torque = torques[stamp].delivered[marker.id]
            if marker.ns == "ankle_spring":
                torque = torques[stamp].intrinsic[marker.id]
            assert (marker.action == Marker.ADD) == (torque != 0)
            if torque and marker.type == Marker.LINE_STRIP:
                assert arc_angle(marker) == pytest.approx(SCALE * torque, abs=1e-9)
            if torque and marker.ns == "pulse":
                acts = torques[stamp].effective_perturbation[marker.id] != 0
                assert (marker.color.r > 2 * marker.color.g) == acts
                seen.add(acts)
    assert seen == {True, False}


def test_a_hanging_display_holds_up_no_other_node(tmp_path):
    # More samples than a writer queues for a reader that it waits for.
    walk = ("--baseline=20", "--pulses=2", "--washout=0")
    with session(tmp_path, *walk, nodes=(*NODES, DISPLAY), real_time=False) as nodes:
        progress = nodes.probe.listen(WALKER_PROGRESS)
        goal = nodes.conduct()
        nodes.probe.until(lambda: progress, "the first grant")
        nodes.signal(DISPLAY, signal.SIGSTOP)
        assert progress[-1].samples < 3000
        result = nodes.probe.result(goal).result
        assert result.outcome == RunProtocol.Result.FINISHED, result.message
        nodes.probe.until(lambda: progress[-1].samples > 8000, "all samples")
