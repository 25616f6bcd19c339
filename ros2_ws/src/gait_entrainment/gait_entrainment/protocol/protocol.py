# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The protocol of one entrainment experiment: one block, or several in a row."""

from dataclasses import asdict, dataclass, field
from enum import Enum
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.protocol.block import Block, PulsePlan
from gait_entrainment.robot import DeviceLimits, Dose, PlannedPulses
from gait_entrainment.settings import Setting, setting, settings_of


@dataclass(frozen=True)
class Protocol(Block):
    """
    One complete experiment: what read_protocol returns and what a bag keeps.

    Without ``blocks`` it is its own only block.
    """

    name: str = setting("paper_example", "name of the experiment, and of its bag", plain=True)
    side: Side = setting(Side.RIGHT, "the perturbed leg: left or right")
    walker: WalkerParameters = field(default_factory=WalkerParameters)
    variation: Variation = field(default_factory=Variation)  # of the simulated walker's strides
    limits: DeviceLimits = field(default_factory=DeviceLimits)  # of what the person may receive
    driver: str = setting("ideal", "ankle robot driver, as listed by entrain driver list")
    seed: int = setting(0, "seed of everything that is random", within=(0, 2**63 - 1))
    blocks: tuple[Block, ...] = ()

    def __post_init__(self) -> None:
        """Check every field; if every block is on the other leg, make that the protocol's."""
        super().__post_init__()
        if all(self.leg(block) is not self.side for block in self.sequence):
            object.__setattr__(self, "side", self.side.other)

    def leg(self, block: Block) -> Side:
        """Return the leg whose strides a block counts."""
        return self.side if block.side is None else block.side

    def ankles(self, block: Block) -> tuple[Side, ...]:
        """Return the ankles that get a block's pulses, its own leg's first."""
        leg = self.leg(block)
        return (leg, leg.other) if block.both_legs else (leg,)

    @property
    def sides(self) -> tuple[Side, ...]:
        """The ankles that get pulses in any block, the protocol's leg's first."""
        found = {side for block in self.sequence for side in self.ankles(block)}
        return tuple(sorted(found, key=lambda side: side is not self.side))

    @property
    def sequence(self) -> tuple[Block, ...]:
        """The blocks in order."""
        return self.blocks or (self,)

    @property
    def strides(self) -> int:
        """Strides of the whole run: baselines, washouts, and one per pulse whatever its period."""
        return sum(block.baseline + block.pulses.count + block.washout for block in self.sequence)

    @property
    def pulse_torque(self) -> float:
        """Height of the largest pulses [N m], plantarflexion positive."""
        return max((block.torque(self.walker) for block in self.sequence), key=abs)

    @property
    def planned(self) -> PlannedPulses:
        """Bounds on the pulses of all blocks."""
        plans = [block.pulses for block in self.sequence]
        return PlannedPulses(
            torque=abs(self.pulse_torque),
            duration=max(plan.width for plan in plans),
            count=sum(len(self.ankles(b)) * b.pulses.count for b in self.sequence),
        )

    @property
    def dose(self) -> Dose:
        """What all blocks will deliver, at both ankles."""
        dose = Dose(self.planned.count)
        for number, block in enumerate(self.sequence, 1):
            heights = len(self.ankles(block)) * sum(block.pulses.heights(1.0, (self.seed, number)))
            dose.impulse += heights * block.pulses.pulse(0, block.torque(self.walker)).impulse
        return dose

    def check_limits(self, *blocks: Block) -> None:
        """Raise LimitError if a pulse (of ``blocks``, or any) or the dose exceeds the limits."""
        for block in blocks or self.sequence:
            self.limits.check_pulse(block.pulses.pulse(0, block.torque(self.walker)))
        self.limits.check_dose(self.dose, ())


SECTIONS: dict[str, type[Any]] = {
    "pulses": PulsePlan,
    "walker": WalkerParameters,
    "variation": Variation,
    "limits": DeviceLimits,
}


def _fields_of(kind: type[Any], *sections: str) -> dict[str, Setting]:
    return settings_of(kind) | {
        f"{section}.{name}": rule
        for section in sections
        for name, rule in settings_of(SECTIONS[section]).items()
    }


# All fields of a protocol, by the names that files and messages use: "pulses.width".
FIELDS = _fields_of(Protocol, *SECTIONS)
# The fields that a block may have.
BLOCK_FIELDS = _fields_of(Block, "pulses")

# Written for every protocol; fields added later are written only if not at their default.
_ALWAYS = ("name", "side", "baseline", "pulses", "washout", "walker", "limits", "driver", "seed")
_ALWAYS_OF_PULSES = (
    *("count", "width", "torque", "torque_fraction"),
    *("period", "period_offset", "initial_phase"),
)


def content_of(protocol: Protocol) -> dict[str, Any]:
    """Return the content of a protocol by section, field and block; enumerations as words."""
    content = changes(protocol, _ALWAYS)
    content["pulses"] = changes(protocol.pulses, _ALWAYS_OF_PULSES)
    if protocol.blocks:
        for name in ("baseline", "pulses", "washout"):
            del content[name]
        always = ("name", "baseline", "pulses", "washout")
        content["blocks"] = [
            changes(block, always) | {"pulses": changes(block.pulses, _ALWAYS_OF_PULSES)}
            for block in protocol.blocks
        ]
    return content


def changes(instance: Any, always: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return settings by name: those in ``always``, and all that are not at their default."""
    values, defaults = asdict(instance), asdict(type(instance)())
    chosen = [
        *always,
        *(name for name in values if name not in always and values[name] != defaults[name]),
    ]
    return {
        name: values[name].name.lower() if isinstance(values[name], Enum) else values[name]
        for name in chosen
    }
