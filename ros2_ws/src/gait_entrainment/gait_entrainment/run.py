# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a simulated and a recorded run have in common: events, pulses, analysis, block by block."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.experiment import BlockRun
from gait_entrainment.gait import Analysis, GaitEvent, Stride, VerdictSettings, analyze
from gait_entrainment.protocol import Block, Protocol
from gait_entrainment.robot import PulseTiming


def settings_for(
    plans: Sequence[Block], settings: VerdictSettings | None = None
) -> VerdictSettings | None:
    """
    Return the verdict settings for the pulses that some blocks plan.

    Pulses by phase follow the gait, so their constant lag shows nothing, whatever their period.
    """
    pulses = [plan.pulses for plan in plans]
    irregular = max((4 * p.jitter + abs(p.sweep) for p in pulses), default=0.0)
    changes: dict[str, Any] = {"irregularity": irregular} if irregular else {}
    if any(p.phase is not None for p in pulses):
        changes["smallest_difference"] = 1.0
    return replace(settings or VerdictSettings(), **changes) if changes else settings


@dataclass(frozen=True)
class JudgedBlock:
    """One block of a run, analyzed by itself against its own baseline."""

    name: str
    side: Side  # the leg whose strides count
    first_stride: int
    last_stride: int | None  # None if it did not end
    end: float  # heel strike that ends it [ns]; infinite if it did not end
    measured_period: float  # mean stride period over its baseline [s]; NaN if unknown
    pulse_period: float  # as planned [s]; NaN if unknown, or by phase
    analysis: Analysis


def analyze_blocks(
    blocks: Sequence[BlockRun],
    events: Sequence[GaitEvent],
    onsets: Sequence[tuple[Side, int]],
    side: Side,
    settings: VerdictSettings | None = None,
    unknown: Sequence[tuple[Side, int, int]] = (),
) -> tuple[Analysis, tuple[JudgedBlock, ...]]:
    """
    Analyze a run and each of its blocks, unless it is a single block of fixed length.

    As ``analyze``, for each leg separately; ``blocks`` are those of a conductor that has seen the
    events. With blocks, the run's pulses, verdicts and holes are those of its blocks.
    """
    plans = [block.plan for block in blocks]

    def on(leg: Side, start: float = 0, end: float = math.inf) -> tuple[list[int], list[Any]]:
        holes = [(a, b) for s, a, b in unknown if s is leg and start < b and a < end]
        return [onset for s, onset in onsets if s is leg and start <= onset < end], holes

    own, missing = on(side)
    overall = analyze(events, own, side, settings_for(plans, settings), missing)
    if len(blocks) <= 1 and not any(block.plan.open_ended for block in blocks):
        return overall, ()
    judged = []
    for block in blocks:
        start = block.start or 0
        end = math.inf if block.end is None else block.end
        own, missing = on(block.leg, start, end)
        analysis = analyze(
            [event for event in events if start <= event.stamp <= end],
            own,
            block.leg,
            settings_for([block.plan], settings),
            missing,
            block.strides_before,
        )
        strides = [stride.number for stride in analysis.strides if stride.end == end]
        judged.append(
            JudgedBlock(
                name=block.plan.name,
                side=block.leg,
                first_stride=block.strides_before + 1,
                last_stride=strides[0] if strides else None,
                end=end,
                measured_period=block.measured_period,
                pulse_period=block.pulse_period,
                analysis=analysis,
            )
        )
    parts = [block.analysis for block in judged]
    pulses, entrainments, holes = (
        tuple(chain.from_iterable(getattr(part, name) for part in parts))
        for name in ("pulses", "entrainments", "holes")
    )
    return replace(overall, pulses=pulses, entrainments=entrainments, holes=holes), tuple(judged)


@dataclass(frozen=True)
class Run:
    """What a simulated and a recorded run have in common; stamps are integer nanoseconds."""

    protocol: Protocol | None  # None if unknown
    events: tuple[GaitEvent, ...]  # in order of arrival
    delivered: tuple[tuple[Side, PulseTiming], ...]  # pulses, ankle by ankle
    measured_period: float  # mean stride period before the pulses [s]; NaN if unknown
    pulse_period: float  # as planned, or as seen without a protocol [s]; NaN if unknown
    analysis: Analysis
    blocks: tuple[JudgedBlock, ...]  # empty for a single block of fixed length

    @property
    def strides(self) -> list[Stride]:
        """The strides of the protocol, without any that follow; all if there is no protocol."""
        if self.blocks:
            return [s for s in self.analysis.strides if s.end <= self.blocks[-1].end]
        last = math.inf if self.protocol is None else self.protocol.strides
        return [stride for stride in self.analysis.strides if stride.number <= last]

    @property
    def onsets(self) -> tuple[int, ...]:
        """Commanded onsets of the pulses."""
        return tuple(timing.commanded for _, timing in self.delivered)

    @property
    def timings(self) -> tuple[PulseTiming, ...]:
        """Commanded, sent and measured onset of each pulse."""
        return tuple(timing for _, timing in self.delivered)
