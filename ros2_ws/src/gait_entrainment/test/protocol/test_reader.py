# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Protocol files: what reads back the same, and the messages about what is refused."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import Side
from gait_entrainment.protocol import (
    DEFAULT_PROTOCOL,
    Protocol,
    ProtocolError,
    PulsePlan,
    read_protocol,
    write_protocol,
)


def test_the_default_is_the_papers_example():
    plan = read_protocol().pulses
    assert (plan.count, plan.width, plan.torque_fraction) == (50, 0.1, 0.1)
    assert plan.period_offset == -0.05
    assert (DEFAULT_PROTOCOL.baseline, DEFAULT_PROTOCOL.washout) == (15, 15)
    assert DEFAULT_PROTOCOL.strides == 80
    # 17 % of body weight times leg length, a tenth of it, within the rounding of Table 1.
    assert DEFAULT_PROTOCOL.pulse_torque == pytest.approx(0.1 * 0.17 * 80 * 9.81, rel=1e-3)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    side=st.sampled_from(Side),
    baseline=st.integers(2, 1000),
    count=st.integers(1, 1000),
    width=st.floats(1e-3, 0.5),
    torque=st.one_of(st.none(), st.floats(-200, 200)),
    period=st.one_of(st.none(), st.floats(0.6, 10)),
    offset=st.floats(-0.3, 0.3),
    phase=st.floats(0, 1, exclude_max=True),
    mass=st.floats(30, 150),
    driver=st.text(st.characters(codec="utf-8")),
    seed=st.integers(0, 2**63 - 1),
)
def test_what_is_written_reads_back_the_same(
    side, baseline, count, width, torque, period, offset, phase, mass, driver, seed
):
    stiffness = 87.3 * mass / 80  # the same gait, whatever the mass
    protocol = Protocol(
        side=side,
        baseline=baseline,
        driver=driver,
        seed=seed,
        pulses=PulsePlan(
            count=count,
            width=width,
            torque=torque,
            torque_fraction=0.2 if torque is None else None,
            period=period,
            period_offset=offset if period is None else None,
            initial_phase=phase,
        ),
        walker=type(DEFAULT_PROTOCOL.walker)(mass=mass, ankle_stiffness=stiffness),
    )
    assert read_protocol(write_protocol(protocol)) == protocol


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("baselin: 3", ("baselin", "unknown field", "baseline")),
        ("baseline: 1", ("baseline", "at least 2")),
        ("baseline: 0", ("baseline", "from 1 to 1000000")),
        ("baseline: 2.5", ("baseline", "whole number")),
        ("baseline: yes", ("baseline: 'yes'", "whole number")),
        ("baseline: 2024-01-01", ("baseline: '2024-01-01'", "whole number")),
        ("washout: -1", ("washout", "from 0 to 1000000")),
        ("side: middle", ("side", "left, right")),
        ("name: ../x", ("name", "plain name")),
        ('name: "a\\nb"', ("name", "plain name")),
        ("pulses: 3", ("pulses", "mapping")),
        ("pulses: {width: -0.1}", ("pulses.width", "-0.1", "1e-09 to 10 s")),
        ("pulses: {width: 1e-10}", ("pulses.width", "1e-10", "1e-09 to 10 s")),
        ("pulses: {period: 1e-9}", ("pulses.period", "'1e-9'", "0.001 to 100 s")),
        ("pulses: {width: !!int abc}", ("pulses.width", "'abc' cannot be read")),
        ("pulses: {width: !unknown 3}", ("pulses.width", "cannot be read")),
        (f"pulses: {{width: {'9' * 5000}}}", ("pulses.width", "cannot be read")),
        (f"pulses: {{torque: 1{'0' * 400}}}", ("pulses.torque", "inf", "finite")),
        ("baseline: 012", ("baseline: 012 is 10 in YAML; write a decimal number",)),
        ("baseline: 0x10", ("baseline: 0x10 is 16 in YAML",)),
        ("baseline: 1:30", ("baseline: 1:30 is 90 in YAML",)),
        ("rest: 1:30.0", ("rest: 1:30.0 is 90.0 in YAML",)),
        ("? [rest]\n: 1", ("?: unknown field",)),
        ('baseline: "5"', ("baseline: '5' is text: remove the quotes",)),
        ("pulses: {width: '0.1'}", ("pulses.width: '0.1' is text",)),
        ("walker: {mass: 0120}", ("walker.mass: 0120 is 80 in YAML",)),
        ("pulses.width: 0.2", ("pulses.width", "unknown field", "pulses")),
        ("baseline: 1000001", ("baseline", "1000001", "to 1000000")),
        ("pulses: {width: .nan}", ("pulses.width", "nan")),
        ("pulses: {width: abc}", ("pulses.width", "'abc'", "1e-09 to 10 s")),
        ("pulses: {width: [1]}", ("pulses.width", "single value")),
        ("pulses: {wdth: 1}", ("pulses.wdth", "unknown field", "width")),
        ("pulses: {period: 0.05}", ("pulses.width", "overlap")),
        ("pulses: {period: .inf}", ("pulses.period", "inf")),
        ("pulses: {initial_phase: 1}", ("pulses.initial_phase", "below 1")),
        ("pulses: {torque: 5, torque_fraction: 0.1}", ("torque_fraction", "not both")),
        ("pulses: {period: 2, period_offset: 0.1}", ("period_offset", "not both")),
        ("pulses: {phase: 1}", ("pulses.phase: 1", "at least 0 and below 1")),
        ("pulses: {phase: 0.5, period: 2}", ("give either pulses.period or", "not both")),
        ("pulses: {phase: 0.5, sweep: 0.1}", ("pulses.sweep: does not go with phase",)),
        ("pulses: {phase: 0.5, initial_phase: 0.1}", ("pulses.initial_phase", "phase")),
        ("pulses: {phase: 0.5, count: 3}\nbaseline: 2", ("baseline: 2", "at least 3")),
        ("pulses: {period: 2, sweep: -1.95}", ("pulses.sweep: -1.95", "overlap", "0.05 s")),
        ("pulses: {period: 2, jitter: 0.96}", ("pulses.jitter: 0.96", "overlap", "0.08 s")),
        ("pulses: {shape: triangle}", ("pulses.shape", "square, half_sine, trapezoid, samples")),
        ("pulses: {rise: 0.01}", ("pulses.rise: does not go with shape square",)),
        ("pulses: {samples: [0, 1]}", ("pulses.samples: does not go with shape square",)),
        ("pulses: {shape: trapezoid, rise: 0.2}", ("pulses.rise", "at most the width of 0.1 s")),
        ("pulses: {shape: samples, samples: [0, x]}", ("pulses.samples: '0, x'", "numbers")),
        ("pulses: {shape: samples, samples: [0, 2]}", ("pulses.samples", "from -1 to 1")),
        ("pulses: {shape: samples}", ("pulses.samples", "2 to 10000")),
        ("pulses: {catch_pulses: [5, 51]}", ("pulses.catch_pulses: 51; allowed: from 1 to 50",)),
        ("pulses: {catch_share: 0.1, catch_pulses: [1]}", ("pulses.catch_pulses", "catch_share")),
        ("blocks: 3", ("blocks", "list of at least one")),
        ("blocks: []", ("blocks", "list of at least one")),
        ("blocks: [3]", ("must be a mapping",)),
        ("blocks: [{side: middle}]", ("side: 'middle'; allowed: left, right, both",)),
        ("blocks: [{walker: {mass: 70}}]", ("walker: unknown field; allowed: baseline",)),
        ("blocks: [{blocks: []}]", ("blocks: unknown field",)),
        ("blocks: [{pulses: {wdth: 1}}]", ("pulses.wdth: unknown field",)),
        ('blocks: [{name: "a\\nb"}]', ("name", "plain name")),
        ("blocks: [{rest: -1}]", ("rest: -1", "0 to 86400 s")),
        ("blocks: [{pulses: {count: 3}}, {pulses: {period: 0.05}}]", ("pulses.width", "overlap")),
        ("walker: {ankle_stiffness: 60}", ("ankle_stiffness", "67.4792 to 111.878")),
        ("walker: {leg_length: 1e-200, foot_length: 2e-201}", ("walker", "too large")),
        ("walker: {mass: .nan}", ("mass",)),
        ("walker: {weight: 3}", ("walker.weight", "unknown field", "mass")),
        ("seed: 1\nseed: 2", ("seed", "twice")),
    ],
)
def test_a_mistake_is_reported_with_its_line(line, words):
    text = "# a protocol\nname: mine\n" if not line.startswith("name") else "# a protocol\n\n"
    with pytest.raises(ProtocolError) as refused:
        read_protocol(text + line + "\n")
    message = str(refused.value)
    place = 4 if line.startswith("seed") or "\nbaseline" in line else 3
    assert message.startswith(f"protocol:{place}: "), message
    assert "\n" not in message
    for word in words:
        assert word in message


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ProtocolError, match=r"nowhere\.yaml: cannot be read: No such file"):
        read_protocol(tmp_path / "nowhere.yaml")
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProtocolError, match="not UTF-8"):
        read_protocol(binary)
    broken = tmp_path / "broken.yaml"
    broken.write_text("name: x\npulses: {width: 1\n")
    with pytest.raises(ProtocolError, match=r"broken\.yaml:3: not valid YAML"):
        read_protocol(broken)
    broken.write_text("{a: " * 3000)
    with pytest.raises(ProtocolError, match=r"broken\.yaml: nested too deeply"):
        read_protocol(broken)


def test_an_empty_file_is_the_default(tmp_path):
    (tmp_path / "empty.yaml").write_text("# nothing\n")
    assert read_protocol(tmp_path / "empty.yaml") == DEFAULT_PROTOCOL


def test_an_option_replaces_the_files_value_and_its_alternative():
    protocol = read_protocol(
        "pulses: {torque: 5, period: 2.0}\n\n",
        {"pulses.torque_fraction": (0.2, "--torque-fraction")},
    )
    assert protocol.pulses.torque is None
    assert protocol.pulses.torque_fraction == 0.2
    assert protocol.pulses.period == 2.0
    both = {"pulses.period": (1.8, "--period"), "pulses.period_offset": (-0.1, "--period-offset")}
    with pytest.raises(ProtocolError, match=r"^--period-offset: .* not both"):
        read_protocol(None, both)
    with pytest.raises(ProtocolError, match=r"^--width: pulses.width: -1"):
        read_protocol(None, {"pulses.width": (-1.0, "--width")})


def test_options_that_contradict_each_other_are_refused():
    both = {"pulses.period": (1.9, "--period"), "pulses.period_offset": (0.1, "--period-offset")}
    with pytest.raises(ProtocolError, match=r"^--period-offset: .*not both"):
        read_protocol(None, both)


def test_text_is_taken_as_written():
    protocol = read_protocol("name: 2012\npulses: {catch_pulses: 5}\nseed: 07\n")
    assert protocol.seed == 7
    assert (protocol.name, protocol.pulses.heights(1.0, (0, 1))[4]) == ("2012", 0.0)


def test_a_number_without_a_dot_in_scientific_notation_is_a_number():
    assert read_protocol("pulses: {width: 1e-1}\n\n").pulses.width == 0.1


def test_pulses_that_would_overlap_at_the_measured_period_are_refused():
    with pytest.raises(ProtocolError, match="overlap"):
        PulsePlan(width=0.1, period_offset=-1.9).period_for(1.93)
    assert PulsePlan(period_offset=-0.05).period_for(2.0) == 1.95
    # The width rounds up to 3 ns, and some of the onsets are only 2 ns apart.
    with pytest.raises(ProtocolError, match="overlap"):
        PulsePlan(width=2.6e-9, period_offset=0.0).period_for(2.7e-9)
    assert math.isnan(PulsePlan(period_offset=0.0).period_for(1.0)) is False


BLOCKS = """
name: two
pulses: {width: 0.05, torque: 8, count: 5}
washout: 3
blocks:
  - name: fast
    pulses: {period_ratio: 0.97, shape: samples, samples: [0, 0.5, 1, 0]}
    rest: 20
  - baseline_time: 30
    pulses: {phase: 0.4, torque_fraction: 0.2, count: 0}
"""


def test_fields_outside_the_blocks_are_the_defaults_of_each_block():
    protocol = read_protocol(BLOCKS)
    fast, other = protocol.blocks
    assert (fast.name, fast.baseline, fast.washout, fast.rest) == ("fast", 15, 3, 20.0)
    assert (fast.pulses.width, fast.pulses.torque, fast.pulses.count) == (0.05, 8.0, 5)
    assert (fast.pulses.period_ratio, fast.pulses.period_offset) == (0.97, None)
    assert fast.pulses.pulse(0, 8.0).samples == (0.0, 0.5, 1.0, 0.0)
    assert (other.name, other.baseline_time, other.pulses.width) == ("block", 30.0, 0.05)
    assert (other.pulses.torque, other.pulses.torque_fraction) == (None, 0.2)
    assert (other.pulses.phase, other.pulses.count) == (0.4, 0)
    assert protocol.strides == (15 + 5 + 3) + (15 + 0 + 3)
    assert (protocol.planned.torque, protocol.planned.count) == (abs(protocol.pulse_torque), 5)
    assert read_protocol(write_protocol(protocol)) == protocol


def test_an_option_replaces_the_value_in_every_block():
    overrides = {"pulses.count": (7, "--pulses"), "name": ("mine", "--name")}
    protocol = read_protocol(BLOCKS, overrides)
    assert protocol.name == "mine"
    assert [block.pulses.count for block in protocol.blocks] == [7, 7]


def test_a_mistake_in_a_block_is_reported_with_its_line():
    text = BLOCKS + "  - baseline: 1\n"
    with pytest.raises(ProtocolError, match=r"^protocol:11: baseline: 1 leaves no complete"):
        read_protocol(text)


def test_fields_added_later_are_not_written_at_their_defaults():
    text = write_protocol(DEFAULT_PROTOCOL)
    fields = [line.partition(":")[0].strip() for line in text.splitlines()]
    assert fields == [
        *("name", "side", "baseline", "pulses", "count", "width", "torque_fraction"),
        *("period_offset", "initial_phase", "washout", "walker", "mass", "leg_length"),
        *("foot_length", "gravity", "leg_angle", "max_plantarflexion", "ankle_stiffness"),
        *("driver", "seed"),
    ]
