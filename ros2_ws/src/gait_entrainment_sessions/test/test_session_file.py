# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Session files: what blocks override, what follows from the person, mistakes in one line."""

from pathlib import Path

import pytest

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import PulsePlan
from gait_entrainment_sessions.session_file import SessionError, read_session

ROOT = Path(__file__).parents[4]


def test_values_of_a_block_replace_the_common_ones(write):
    faster, slower = read_session(write()).blocks
    assert (faster.name, faster.rest, slower.rest) == ("faster", 30.0, 20.0)
    assert faster.protocol.pulses == PulsePlan(
        count=20, torque=9.0, torque_fraction=None, period_offset=-0.05
    )
    assert slower.protocol.pulses == PulsePlan(count=20, period=1.9, period_offset=None)
    for block in (faster, slower):
        assert block.protocol.side is Side.LEFT
        assert block.protocol.limits.torque == 15
        assert block.protocol.name == block.name


def test_the_walker_has_the_persons_size_in_the_papers_proportions(write):
    paper, walker = WalkerParameters(), read_session(write()).blocks[0].protocol.walker
    assert (walker.mass, walker.leg_length) == (72, 0.91)
    assert walker.peak_torque / (72 * 0.91) == pytest.approx(paper.peak_torque / 80)
    heavy = ("  side: left", "  walker: {mass: 75}\n  side: left")
    assert read_session(write(heavy)).blocks[0].protocol.walker.mass == 75


def test_a_protocol_may_be_a_file_next_to_the_session(write):
    path = write(("{pulses: {period: 1.9, torque_fraction: 0.1}}", "slower.yaml"))
    (path.parent / "slower.yaml").write_text("pulses:\n  period: 1.9\n  width: 0.2\n")
    pulses = read_session(path).blocks[1].protocol.pulses
    assert (pulses.period, pulses.width, pulses.torque) == (1.9, 0.2, 9.0)
    (path.parent / "slower.yaml").write_text("pulses:\n  period: 1.9\n  width: -1\n")
    with pytest.raises(SessionError, match=r"/slower.yaml:3: pulses.width: -1"):
        read_session(path)


SLOWER = "{pulses: {period: 1.9, torque_fraction: 0.1}}"


def test_a_protocol_may_have_its_own_blocks_and_lists(write):
    shaped = "{pulses: {period: 1.9, shape: samples, samples: [0, 1, 0], catch_pulses: [3, 5]}}"
    pulses = read_session(write((SLOWER, shaped))).blocks[1].protocol.pulses
    assert (pulses.samples, pulses.catch_pulses) == ("0, 1, 0", "3, 5")
    repeated = ("  pulses:\n", "  pulses: &all\n"), (SLOWER, "{pulses: *all}")
    assert read_session(write(*repeated)).blocks[1].protocol.pulses.count == 20
    common = ("\n  pulses:\n    count: 20\n    torque: 9.0", "")
    own = "{blocks: [{name: a}, {name: b, washout: 3}]}"
    protocol = read_session(write((SLOWER, own), common)).blocks[1].protocol
    assert [block.name for block in protocol.blocks] == ["a", "b"]
    assert protocol.side is Side.LEFT
    assert protocol.walker.mass == 72
    with pytest.raises(SessionError, match=r":9: pulses.count: does not go with the blocks"):
        read_session(write((SLOWER, own)))


MISTAKES = [
    ("count: 20", "count: x", 9, "pulses.count: 'x'; allowed: a whole number from 0"),
    ("torque: 9.0", "torqe: 9", 10, "pulses.torqe: unknown field; allowed: "),
    ("torque: 9.0", "torque: 16", 10, "torque: 16 N m is outside the limit"),
    ("torque_fraction: 0.1", "width: 0.6", 15, "width: 0.6 s is outside the limit"),
    ("side: left", "driver: emulatd", 7, "driver: 'emulatd' is unknown; allowed: "),
    ("side: left", "limits: {torque: 4}", 7, "limits.torque: limits belong to the person"),
    ("code: P01", "code: P 01", 3, "person.code: 'P 01'; allowed: letters and digits"),
    ("number: 2, ", "nmber: 2, ", 3, "person.nmber: unknown field; allowed: code, leg_length"),
    ("mass: 72, ", "", 3, "person.mass: missing; allowed: 5 to 500 kg"),
    (
        "number: 2, ",
        "number: 012, ",
        3,
        "person.number: 012 is 10 in YAML; write a decimal number",
    ),
    ("mass: 72", "mass: 7000", 3, "person.mass: 7000.0; allowed: 5 to 500 kg"),
    ("name: slower", "name: faster", 15, "name: faster: appears twice; keep one"),
    ("name: slower, ", "", 15, "name: missing; allowed: a plain name"),
    ("period: 1.9, ", "period: 0.05, ", 15, "pulses.width: 0.1 s makes the pulses overlap"),
    ("rest: 30", "rest: -1", 5, "rest: -1.0; allowed: 0 to 86400 s"),
    ("rest: 30", "order: best", 5, "order: 'best'; allowed: written, permuted, balanced"),
    ("rest: 30", "blind: perhaps", 5, "blind: 'perhaps'; allowed: true, false"),
    ("rest: 30", "seed: 1.5", 5, "seed: 1.5; allowed: a whole number"),
    ("rest: 30", "limits: {torqe: 15}", 5, "limits: appears twice"),
    ("torque: 15", "session_pulses: 19", 4, "session_pulses: 20 in all; allowed: at most 19"),
    ("torque: 15", "session_pulses: 39", 4, "limits.session_pulses: 40 in all; allowed: at mo"),
    ("torque: 15", "session_impulse: 30", 4, "limits.session_impulse: 39.8"),
    ("torque: 15", "torqe: 15", 4, "limits.torqe: unknown field; allowed: arming"),
    ("study: pilot", "study: [pilot", 2, "not valid YAML"),
    ("study: pilot", "study: {a: b}", 1, "study: must be a single value"),
    ("blocks:", "block:", 11, "block: unknown field; allowed: blind, blocks"),
]


@pytest.mark.parametrize(("old", "new", "line", "message"), MISTAKES)
def test_a_mistake_is_one_line_naming_file_line_and_field(write, old, new, line, message):
    path = write((old, new))
    with pytest.raises(SessionError) as error:
        read_session(path)
    assert str(error.value).startswith(f"{path}:{line}: ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_real_robot_needs_limits_for_the_person(write):
    real = ("  side: left", "  driver: odrive_can")
    with pytest.raises(SessionError, match=r"limits.torque: missing, and the driver odrive_can"):
        read_session(write(real, ("limits: {torque: 15}\n", "")))
    with pytest.raises(SessionError, match=r"limits.torque: missing"):
        read_session(write(real, ("limits: {torque: 15}", "limits: {rate: 500}")))
    assert read_session(write(real)).blocks[0].protocol.driver == "odrive_can"


@pytest.mark.parametrize("text", ["", "# nothing\n", "- a\n", "study: x\n", "\xff"])
def test_a_file_that_is_not_a_session_is_reported_in_one_line(tmp_path, text):
    path = tmp_path / "session.yaml"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(SessionError) as error:
        read_session(path)
    assert str(error.value).startswith(f"{path}")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("path", sorted((ROOT / "examples/sessions").glob("*.yaml")))
def test_examples_can_be_read(path):
    session = read_session(path)
    assert len(session.blocks) > 1
    assert sorted(block.name for block in session.ordered) == sorted(
        block.name for block in session.blocks
    )
