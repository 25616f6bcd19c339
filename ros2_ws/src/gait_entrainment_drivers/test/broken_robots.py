# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Drivers that each break one promise of the contract, derived from ones that keep them all."""

import math
import time
from dataclasses import dataclass, replace

from gait_entrainment.robot import Fault, PulseTrain, Shape
from gait_entrainment.robot.ideal import IdealAnkleRobot
from gait_entrainment_drivers.emulated import EmulatedAnkleRobot


@dataclass(frozen=True)
class OptionsWithoutMeaning:
    rate: float = 1000.0


def changed(train, changes):
    """Return the train with each pulse changed: ``changes`` gives its new values."""
    return PulseTrain(
        train.side, tuple(replace(pulse, **changes(pulse)) for pulse in train.pulses)
    )


class NoPeakTorque(IdealAnkleRobot):
    def __init__(self, side, options, seed):
        super().__init__(side, options, seed)
        self.capabilities = replace(self.capabilities, peak_torque=0.0)


class UnexplainedOptions(IdealAnkleRobot):
    Options = OptionsWithoutMeaning


class CannotReconnect(IdealAnkleRobot):
    closed = False

    def configure(self):
        super().configure()
        if self.closed:
            raise OSError("the port is still open")

    def close(self):
        super().close()
        self.closed = True


class FailsToDeactivate(IdealAnkleRobot):
    def deactivate(self):
        raise OSError("no answer")


class PushesWithoutTrain(IdealAnkleRobot):
    def promise(self, until):
        profile = super().promise(until)
        return replace(profile, torques=tuple(torque + 0.6 for torque in profile.torques))


class FaultWithoutReason(IdealAnkleRobot):
    def read(self):
        return [replace(s, faults=(Fault("odd", "Nothing is wrong."),)) for s in super().read()]


class SwallowsAPulse(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(PulseTrain(train.side, train.pulses[:-1] or train.pulses))


class ForgetsThePreviousTrain(IdealAnkleRobot):
    def schedule(self, train):
        self._train = None
        super().schedule(train)


class KnowsOnlySquarePulses(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(changed(train, lambda _: {"shape": Shape.SQUARE}))


class WrongSign(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(changed(train, lambda pulse: {"torque": -pulse.torque}))


class OnsetsNotReported(IdealAnkleRobot):
    def promise(self, until):
        return replace(super().promise(until), onsets=())


class HalfTheImpulse(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(changed(train, lambda pulse: {"duration": pulse.duration / 2}))


class DependsOnTheCuts(EmulatedAnkleRobot):
    """Reduces its torque once more at the end of each promise."""

    def promise(self, until):
        profile = super().promise(until)
        self._torque *= 0.9
        return profile


class Overshoots(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(changed(train, lambda pulse: {"torque": 1.3 * pulse.torque}))


class Saturates(IdealAnkleRobot):
    def schedule(self, train):
        limited = changed(train, lambda p: {"torque": min(max(p.torque, -10.0), 10.0)})
        super().schedule(limited)


class CannotRefuse(IdealAnkleRobot):
    """Pushes even if the guard has refused every train: only the kit can notice."""

    def begin(self, start):
        super().begin(start)
        self._begun_at = start

    def promise(self, until):
        profile = super().promise(until)
        if self._train is None and until - self._begun_at > 200_000_000:
            return replace(profile, torques=tuple(2.0 for _ in profile.torques))
        return profile


class GoesOnAfterCancelling(IdealAnkleRobot):
    def cancel(self):
        pass


class DeafAfterCancelling(IdealAnkleRobot):
    def begin(self, start):
        super().begin(start)
        self.cancelled = False

    def cancel(self):
        super().cancel()
        self.cancelled = True

    def schedule(self, train):
        if not self.cancelled:
            super().schedule(train)


class GoesOnAfterAStop(IdealAnkleRobot):
    def stop(self):
        pass


class StopRaises(IdealAnkleRobot):
    def stop(self):
        super().stop()
        raise OSError("no bus")


class CloseRaises(IdealAnkleRobot):
    def close(self):
        super().close()
        raise OSError("no bus")


class StopBlocks(IdealAnkleRobot):
    def stop(self):
        super().stop()
        time.sleep(1.2)


class AcceptsTrainsAfterAStop(IdealAnkleRobot):
    def stop(self):
        self._train = None


class GoesOnAfterDeactivating(IdealAnkleRobot):
    def deactivate(self):
        pass


class RemembersItsTrain(IdealAnkleRobot):
    """Keeps the train across close and begin."""

    kept = None

    def schedule(self, train):
        super().schedule(train)
        self.kept = train

    def begin(self, start):
        super().begin(start)
        self._train = self.kept


class DoesNotAdjoin(IdealAnkleRobot):
    def promise(self, until):
        profile = super().promise(until)
        return replace(profile, times=(profile.times[0] + 1, *profile.times[1:]))


class PromisesNan(IdealAnkleRobot):
    def promise(self, until):
        profile = super().promise(until)
        return replace(profile, torques=tuple(math.nan for _ in profile.torques))


class StatesGoBackwards(EmulatedAnkleRobot):
    def read(self):
        return list(super().read())[::-1]


class StatesAreRare(EmulatedAnkleRobot):
    def read(self):
        return list(super().read())[::2]


class RateInKilohertz(EmulatedAnkleRobot):
    def __init__(self, side, options, seed):
        super().__init__(side, options, seed)
        self.capabilities = replace(self.capabilities, state_rate=options.state_rate / 1000)


class StatesWithoutMeasurement(EmulatedAnkleRobot):
    def read(self):
        return [replace(state, measured=math.nan) for state in super().read()]


class CommandsNotReported(EmulatedAnkleRobot):
    def read(self):
        return [replace(state, commanded=0.0) for state in super().read()]


class PushesLate(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(train.shifted(80_000_000))


class PushesEarly(IdealAnkleRobot):
    def schedule(self, train):
        super().schedule(train.shifted(-5_000_000))


class Dawdles(IdealAnkleRobot):
    def promise(self, until):
        time.sleep(0.012)
        return super().promise(until)


class Hangs(IdealAnkleRobot):
    calls = 0

    def promise(self, until):
        self.calls += 1
        if self.calls == 30:
            time.sleep(0.25)
        return super().promise(until)


# Each with a check that must catch it, and a pattern of the sentence.
BROKEN = [
    (NoPeakTorque, "construction", "peak_torque: 0"),
    (UnexplainedOptions, "construction", "rate does not state its meaning"),
    (CannotReconnect, "lifecycle", "port is still open"),
    (CannotReconnect, "reconnecting", "port is still open"),
    (FailsToDeactivate, "lifecycle", "Deactivating failed: driver_failed"),
    (PushesWithoutTrain, "idle", "0.6 N m without a train"),
    (PushesWithoutTrain, "order", "without a train"),
    (FaultWithoutReason, "idle", "fault: odd"),
    (FaultWithoutReason, "states", "reports odd|latched"),
    (SwallowsAPulse, "pulses", "Onsets"),
    (SwallowsAPulse, "in_turn", "were scheduled"),
    (ForgetsThePreviousTrain, "in_turn", "were scheduled"),
    (KnowsOnlySquarePulses, "shapes", "A pulse of 1.02 N m s had 1.6 N m s"),
    (WrongSign, "pulses", "had -"),
    (OnsetsNotReported, "pulses", "Onsets"),
    (HalfTheImpulse, "pulses", "had 0.6 N m s"),
    (DependsOnTheCuts, "cuts", "promised in pieces"),
    (Overshoots, "at_limits", "torque_exceeded"),
    (Saturates, "at_limits", "reached 10 N m"),
    (CannotRefuse, "beyond_limits", "although every train was refused"),
    (GoesOnAfterCancelling, "cancelling", "after cancelling"),
    (DeafAfterCancelling, "cancelling", "No torque came"),
    (GoesOnAfterAStop, "stopping_in_mid_pulse", "after the stop"),
    (StopBlocks, "stopping_in_mid_pulse", "did not return"),
    (StopRaises, "stopping_in_every_state", "raised OSError"),
    (CloseRaises, "stopping_in_every_state", "raised OSError"),
    (AcceptsTrainsAfterAStop, "stopping_in_every_state", "delivered a train"),
    (GoesOnAfterDeactivating, "deactivating", "after deactivating"),
    (RemembersItsTrain, "new_run", "run before"),
    (RemembersItsTrain, "reconnecting", "after reconnecting"),
    (DoesNotAdjoin, "idle", "does not adjoin"),
    (PromisesNan, "idle", "not all finite"),
    (StatesGoBackwards, "states", "RobotState.* after"),
    (StatesAreRare, "states", "States came at 2.. Hz"),
    (StatesWithoutMeasurement, "states", "measured=nan"),
    (RateInKilohertz, "states", "States came at 5.* Hz; promised: 0.5 Hz"),
    (CommandsNotReported, "states", "No state shows"),
    (PushesLate, "timing", r"\+80.0 ms"),
    (PushesEarly, "timing", "do not appear in the states"),
    (Dawdles, "prompt_calls", "Nine in ten calls"),
    (Hangs, "prompt_calls", "slowest 2"),
]  # fmt: skip
