# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The nodes of an experiment and of a replay: one list for the commands and the launch files.

What a user may set is in config/nodes.yaml. What follows from the protocol, the mode and the bag
is set here.
"""

import json
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import yaml

from gait_entrainment.conventions import Side
from gait_entrainment.gait import GaitLimits
from gait_entrainment.protocol import Protocol, changes, write_protocol
from gait_entrainment.robot import find_driver
from gait_entrainment.run import settings_for
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags.recorded_run import protocol_and_side
from gait_entrainment_bags.topic_names import WALKER_PROGRESS, WALKER_PROGRESS_BEFORE
from gait_entrainment_bringup.provenance import provenance
from gait_entrainment_nodes.messaging.environment import shared_file

RECORDER = "bag_recorder"
# Who walks: the model with its exact events; the model as sensors see it; a person with sensors.
# The last node plays the walker's role towards the others.
WALKERS = {
    "simulated": ("walker_sim",),
    "sensed": ("sensor_sim", "gait_detector"),
    "person": ("gait_detector",),
}


def nodes_for(walker: str) -> tuple[str, ...]:
    """Return the nodes in the order in which they are started, each named as its executable."""
    return (RECORDER, *WALKERS[walker], "perturbator", "gait_analyzer", "experiment")


NODES = nodes_for("simulated")
# An onlooker: started only to show the walk; no node waits for it.
DISPLAY = "walker_display"
# The operator's page: also an onlooker. The operator watches it, so it outlives the torque.
PAGE = "operator_page"
# The client that conducts a run; also the name of the operator who started it.
RUN_CLIENT = "entrain_run"
# In the order in which they are stopped: torque first, the record last.
STOP_ORDER = (
    *("perturbator", "experiment", "walker_sim", "gait_detector", "sensor_sim"),
    *("gait_analyzer", DISPLAY, PAGE, "bag_recorder"),
)
DETECTOR = "vertical_force"
# In real time promises are short, so that decisions can be late, but longer than a hiccup [s].
LEAD_TIME = 0.3
# A real robot's torque is known only once it has been measured and promised. The walker lags this
# far behind the wall clock to show what it felt [s].
MEASURED_DELAY = 0.1
# The flanks of a real robot's pulses, as a share of their width, and how many of its first pulses
# are lower.
FLANK_SHARE = 0.1
RISING = 5
# How much the clocks of a real robot's hosts may differ [s]; a phase lag is no more accurate.
CLOCK_OFFSET = 0.005
# From a sensor's sample to its arrival [s], including the time from one sample to the next.
DELIVERY = 0.03
# How long any node, or the operator, may be silent while a real robot is worn [s].
PERSON_SILENCE = 0.3

# Names at the root that are moved into a namespace, so that each experiment has its own time.
MOVED = (
    "/clock",
    "/diagnostics",
    "/tf",
    "/tf_static",
    # Absolute only in RViz's configuration.
    "/robot_description",
    "/walker_display/markers",
)
# Nodes of a replay; if it is recorded, the recorder comes last.
REPLAY_NODES = ("bag_player", "gait_analyzer")
# Published again in a replay, or about the processes that were recorded.
NOT_REPLAYED = (
    "*/gait/strides",
    "*/gait/pulse_phases",
    "*/gait/entrainment",
    "*/published_counts",
    "*/bag_recorder/progress",
    "*/clock",
    "/rosout",
    "/parameter_events",
)
ANALYZED = ("gait_events", "perturbation/torque_profile", "walker/progress")
MEASURED = ("perturbation/pulses", "perturbator/state")  # if onsets are measured

Parameters = dict[str, dict[str, Any]]  # by node name, then by name


def settings_file() -> Path:
    """Return the file with what a user may set for the nodes."""
    return shared_file("gait_entrainment_bringup", "config/nodes.yaml")


def parameters(
    protocol: Protocol,
    bag: Path | None,
    *,
    real_time: bool = False,
    armed: bool = False,
    unproved: bool = False,
    onset: str = "commanded",
    lead_time: float = LEAD_TIME,
    walker: str = "simulated",
    detector: str = DETECTOR,
    sensor: str = "",
    toe_off_bias: float = 0.0,
) -> Parameters:
    """
    Return the parameters of every node for a run that is recorded into the folder ``bag``, if any.

    If ``armed``, a real robot may deliver torque without further confirmation; if ``unproved``,
    even if its watchdog was not proved (`gait_entrainment_drivers.proof`). ``onset`` is where the
    analyzer takes a pulse to begin: "commanded" or "measured". In real time, promised torque
    leads by ``lead_time`` [s]. ``walker`` is one of WALKERS, ``detector`` finds its events in
    sensor signals, and ``sensor`` is the one to emulate, by default the detector's. Toe-offs are
    detected late by ``toe_off_bias`` [s].
    """
    nodes = nodes_for(walker)
    ankles = {"side": protocol.side.name.lower(), "both_ankles": len(protocol.sides) > 1}
    measured = real_time and not find_driver(protocol.driver).simulated
    given: Parameters = {
        "walker_sim": {
            **asdict(protocol.walker),
            **{f"variation.{name}": value for name, value in asdict(protocol.variation).items()},
            "seed": protocol.seed,
            "first_heel_strike": ankles["side"],
            "both_ankles": ankles["both_ankles"],
            "real_time": real_time,
            "acknowledged": bag is not None and not real_time,
            "presentation_delay": MEASURED_DELAY if measured else 0.0,
        },
        "perturbator": {
            **ankles,
            "driver": protocol.driver,
            "seed": protocol.seed,
            "armed": armed,
            "unproved": unproved,
            **{f"planned.{name}": value for name, value in asdict(protocol.planned).items()},
            **{f"limits.{k}": v for k, v in limits_of(protocol, worn=measured).items()},
        },
        "gait_analyzer": {
            **ankles,
            "onset": onset,
            "toe_off_bias": toe_off_bias,
            **_verdict(protocol),
        },
        "experiment": {
            "participants": [n for n in nodes if n != "experiment" and (bag or n != RECORDER)],
            "walker": WALKERS[walker][-1],
        },
        "bag_recorder": {
            "output": str(bag.absolute()) if bag else "",
            "publishers": [node for node in nodes if node != RECORDER],
            "custom_data": json.dumps(
                provenance(protocol, real_time=real_time, onset=onset)
                | ({"toe_off_bias": repr(toe_off_bias)} if toe_off_bias else {})
            ),
        },
        DISPLAY: _drawn(protocol),
        PAGE: {"record": str(bag.absolute()) if bag else ""},
    }
    latency = 0.0
    if walker != "simulated":
        latency = _add_detection(given, walker, detector, sensor, real_time=real_time)
    if real_time:
        # What is known is older by the latency.
        given["experiment"]["longest_lookahead"] = lead_time + latency
    if measured:
        # A person wears the robot: a node that falls silent ends the torque, and so does a record
        # that cannot be written.
        given["experiment"]["silence_timeout"] = PERSON_SILENCE
        given["perturbator"]["operator_timeout"] = PERSON_SILENCE
        given["experiment"]["longest_clock_offset"] = CLOCK_OFFSET
        given["bag_recorder"]["required"] = True
    return {name: given[name] | {"use_sim_time": not real_time} for name in given}


def _add_detection(
    given: Parameters, walker: str, detector: str, sensor: str, *, real_time: bool
) -> float:
    """Add the nodes that detect the walker's events; return the latency of these events [s]."""
    # Not at the top: few runs need it.
    from gait_entrainment_sensors import find_detector

    chosen = find_detector(detector)
    simulated = given.pop("walker_sim")
    detecting = given["gait_detector"] = {
        "detector": detector,
        "simulated": walker == "sensed",
        "delivery": DELIVERY,
    }
    if walker == "sensed":
        from gait_entrainment_sensors.emulated import USUAL, find_sensor

        sensor = sensor or USUAL.get(chosen.name, chosen.name)
        _, quality = find_sensor(sensor)
        given["sensor_sim"] = simulated | {"sensor": sensor, "ground_reaction": False}
        if not real_time:  # only the deciding sample is still on its way
            detecting["delivery"] = 2 / quality.rate
    return float(max(chosen.make(side).latency for side in Side) + detecting["delivery"])


def limits_of(protocol: Protocol, *, worn: bool) -> dict[str, Any]:
    """
    Return the limits that differ from the defaults: those that the protocol sets.

    If a person has the robot ``worn``, pulses get flanks and the first ones are lower, unless the
    protocol sets this.
    """
    if not worn:
        return changes(protocol.limits)
    gentle: dict[str, float] = {
        "rising": RISING,
        # No two pulses are closer than the shortest plausible stride.
        "pulses_per_minute": 60 / GaitLimits().stride_least,
        # The experiment must name the silent node before the robot reports the silence.
        "silence": PERSON_SILENCE + 0.05,
    }
    rates = [
        abs(block.torque(protocol.walker)) / (FLANK_SHARE * block.pulses.width)
        for block in protocol.sequence
    ]
    if any(rates):
        gentle["rate"] = min(max(rates), 1e6)
    return gentle | changes(protocol.limits)


def _verdict(protocol: Protocol | None) -> dict[str, Any]:
    """Return what the analyzer must know about the protocol's pulses: irregular, or by phase."""
    settings = settings_for(protocol.sequence if protocol else ())
    return {f"verdict.{n}": value for n, value in changes(settings).items()} if settings else {}


def _drawn(protocol: Protocol) -> dict[str, Any]:
    """Return what the display must know about the walker."""
    return {"leg_length": protocol.walker.leg_length, "foot_length": protocol.walker.foot_length}


def replay_parameters(
    path: Path,
    namespace: str | None = None,
    out: Path | None = None,
    protocol: Protocol | None = None,
    side: Side | None = None,
) -> tuple[str, Parameters]:
    """
    Return the namespace and the parameters of a replay of a bag, a folder or an ``.mcap`` file.

    The replay goes into a namespace, by default the recorded one, which is returned without a
    trailing slash. It is recorded into ``out``, if given. ``protocol`` and ``side`` are as
    `protocol_and_side` takes them. The display has parameters only if the bag holds no picture.
    BagError if the bag cannot be read or holds no gait events.
    """
    with BagReader(path) as bag:
        topics = list(bag.topics)
        recorded = bag.find_topic("gait_events")
        if recorded is None:
            raise BagError(f"{path}: not a run of this project: no gait events")
        protocol, side = protocol_and_side(bag, protocol, side)
        custom_data = bag.custom_data
    if protocol is not None:
        custom_data = custom_data | {"protocol": write_protocol(protocol)}
    onset = custom_data.get("onset", "commanded")
    recorded = recorded.removesuffix("/gait_events")
    namespace = recorded if namespace is None else namespace.rstrip("/")
    moved = {n: n for n in topics if namespace != recorded and n.startswith(f"{recorded}/")}
    before = f"{recorded}/{WALKER_PROGRESS_BEFORE}"
    if before in topics:
        moved[before] = f"{recorded}/{WALKER_PROGRESS}"
    analyzed = (*ANALYZED, *MEASURED) if onset == "measured" else ANALYZED
    played = {moved.get(name, name) for name in topics}
    expected = [f"{namespace}/{n}" for n in analyzed if f"{recorded}/{n}" in played]
    given: Parameters = {
        "bag_player": {
            "bag": str(path.absolute()),
            "exclude": list(NOT_REPLAYED),
            "remap": [f"{n}:={namespace}{to.removeprefix(recorded)}" for n, to in moved.items()]
            or [""],
            # By the analyzer, and by the recorder as well.
            "expect": expected if out is None else expected * 2,
            "use_sim_time": False,
        },
        "gait_analyzer": {
            "side": side.name.lower(),
            "both_ankles": protocol is not None and len(protocol.sides) > 1,
            "onset": onset,
            "toe_off_bias": float(custom_data.get("toe_off_bias", "0")),
            "use_sim_time": True,
            **_verdict(protocol),
        },
    }
    if out is not None:
        given["bag_recorder"] = {
            "output": str(out.absolute()),
            "publishers": ["gait_analyzer", "bag_player"],
            "custom_data": json.dumps(custom_data | {"replay_of": path.name}),
            "use_sim_time": True,
        }
    if f"{recorded}/robot_description" not in topics:
        drawn = {} if protocol is None else _drawn(protocol)
        given[DISPLAY] = drawn | {"use_sim_time": True}
    given[PAGE] = {"use_sim_time": True}
    return namespace, given


def bag_folder(protocol: Protocol) -> Path:
    """Return the folder in which a run is recorded by default."""
    return Path("bags") / f"{datetime.now():%Y%m%d-%H%M%S}_{protocol.name}"


def parameter_arguments(given: Parameters, folder: Path) -> list[str]:
    """Return arguments that make a node load config/nodes.yaml, then ``given`` from a folder."""
    file = folder / "parameters.yaml"
    file.write_text(yaml.safe_dump({f"/**/{n}": {"ros__parameters": p} for n, p in given.items()}))
    files = (settings_file(), file)
    return ["--ros-args", *(word for f in files for word in ("--params-file", str(f)))]
