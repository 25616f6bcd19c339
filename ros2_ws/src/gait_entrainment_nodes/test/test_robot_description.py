# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The robot description, moved by the walker's joint angles, is the walker."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import xacro
from scipy.spatial.transform import Rotation

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment_nodes.nodes.footing import Footing
from gait_entrainment_nodes.nodes.walker_sim import JOINTS

URDF = Path(__file__).parents[1] / "urdf" / "sagittal_walker.urdf.xacro"
SMALLER = WalkerParameters(leg_length=0.8, foot_length=0.15, ankle_stiffness=70.0)


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


def points_of(description, angles, base):
    """
    Transform points of the links to the world: independent forward kinematics of any URDF.

    Returns a function of a link and a point in its frame.
    """
    joints = {j.find("child").get("link"): j for j in description.iter("joint")}

    def place(link, point):
        if link not in joints:
            return np.add(base, point)
        joint = joints[link]
        origin = joint.find("origin")
        assert origin.get("rpy") in (None, "0 0 0")
        axis = np.array(numbers(joint.find("axis"), "xyz"))
        turned = Rotation.from_rotvec(angles[joint.get("name")] * axis).apply(point)
        return place(joint.find("parent").get("link"), numbers(origin, "xyz") + turned)

    return place


@pytest.mark.parametrize("parameters", [WalkerParameters(), SMALLER], ids=["paper", "smaller"])
def test_feet_are_where_the_walker_has_them(parameters):
    lengths = {
        "leg_length": str(parameters.leg_length),
        "foot_length": str(parameters.foot_length),
    }
    text = xacro.process_file(str(URDF), mappings=lengths).toxml()
    description = ElementTree.fromstring(text)
    walker = Walker(parameters, Side.RIGHT)
    until = 2_500_000_000
    for side in Side:
        walker.extend_torque(side, [0], [0.0], until)
    strikes = [e.stamp for e in walker.advance(until) if e.kind == EventKind.HEEL_STRIKE]
    assert len(strikes) > 2  # more than a stride
    times = np.arange(0, until, 7_000_000)
    samples = walker.sample(times)
    footing = Footing(parameters.leg_length, parameters.foot_length)
    for i, time in enumerate(times):
        position = samples.position[i]
        x, z = footing.place(position[:2], position[2:])
        place = points_of(description, dict(zip(JOINTS, position, strict=True)), [x, 0.0, z])
        heel = parameters.step_length * (np.searchsorted(strikes, time, side="right") - 1)
        leading, trailing = ("l", "r") if samples.leading[i] == Side.LEFT else ("r", "l")
        toe = [parameters.foot_length, 0.0, 0.0]
        at_heel = place(f"{leading}_sole", [0.0, 0.0, 0.0])[[0, 2]]
        at_toe = place(f"{leading}_sole", toe)[[0, 2]]
        assert at_heel == pytest.approx([heel, 0.0], abs=1e-9)
        assert at_toe == pytest.approx([heel + parameters.foot_length, 0.0], abs=1e-9)
        # The mass in the middle stands on that leg, leaning by theta.
        lean = position[samples.leading[i]]
        mass = place("base_link", [0.0, 0.0, 0.0])
        assert mass - [heel, 0.0, 0.0] == pytest.approx(
            parameters.leg_length * np.array([-np.sin(lean), 0.0, np.cos(lean)]), abs=1e-9
        )
        if samples.double_stance[i]:
            rear = place(f"{trailing}_sole", toe)[[0, 2]]
            assert rear == pytest.approx([heel - parameters.toe_separation, 0.0], abs=1e-9)
    assert 0 < samples.double_stance.sum() < times.size


def test_drawn_shapes_lie_along_leg_and_foot():
    text = xacro.process_file(str(URDF), mappings={"leg_length": "0.8"}).toxml()
    links = {link.get("name"): link for link in ElementTree.fromstring(text).iter("link")}
    for prefix in ("l", "r"):
        leg = links[f"{prefix}_leg"].find("visual")
        assert float(leg.find("geometry/cylinder").get("length")) == 0.8
        assert numbers(leg.find("origin"), "xyz") == [0.0, 0.0, -0.4]
        foot = links[f"{prefix}_sole"].find("visual")
        length, _, height = numbers(foot.find("geometry/box"), "size")
        assert length == 0.2
        # From the heel, under the ankle, to the toe; the sole at the height of the ankle.
        assert numbers(foot.find("origin"), "xyz") == pytest.approx([0.1, 0.0, height / 2])
