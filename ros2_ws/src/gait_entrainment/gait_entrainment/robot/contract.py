# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The contract of an ankle robot driver, for implementers and for the conformance kit."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, ClassVar

from gait_entrainment.conventions import Side
from gait_entrainment.robot.faults import DeviceError, Fault, LimitError
from gait_entrainment.robot.profile import TorqueProfile
from gait_entrainment.robot.pulse_train import PulseTrain


@dataclass(frozen=True)
class Capabilities:
    """What a device can do, given its options."""

    peak_torque: float  # [N m]; inf if it has no limit
    torque_rate: float  # steepest change of torque [N m/s]; inf for a jump
    measures_torque: bool  # read() reports measured torque; otherwise it is computed
    simulated: bool  # in simulated time: promises ahead, uses no clock, worn by nobody
    state_rate: float  # states per second [Hz]; 0: one per change of torque
    torque_bandwidth: float = math.inf  # -3 dB, from command to torque [Hz]

    def __post_init__(self) -> None:
        """Raise LimitError for impossible values: a device is checked against these."""
        for name in ("peak_torque", "torque_rate", "torque_bandwidth"):
            if not (value := getattr(self, name)) > 0:
                raise LimitError(f"capabilities.{name}: {value:g}; allowed: above 0")


@dataclass(frozen=True)
class RobotState:
    """The device at one instant."""

    stamp: int  # [ns], the clock of the run
    commanded: float  # commanded torque [N m]
    measured: float  # measured torque [N m]; NaN if not measured
    angle: float  # measured ankle angle [rad]; NaN if not measured
    faults: tuple[Fault, ...] = ()  # empty when all is well


@dataclass
class LoopTiming:
    """Timing of the loop that streams torque."""

    refused: str = ""  # what the system did not permit
    late: Sequence[float] = ()  # how late its latest commands were [s]


class AnkleRobot(ABC):
    """
    A driver of one ankle robot. It implements every abstract method and keeps these rules.

    **Construction** ``(side, options, seed)`` keeps its arguments and sets ``capabilities``; it
    touches no hardware. Options are a frozen dataclass, ``Options``, whose fields are made by
    ``settings.setting`` and checked before construction; its ``__post_init__`` raises LimitError
    for what the fields cannot express.

    **Lifecycle**, mapped to the perturbator's lifecycle node::

        configure -> activate -> begin -> schedule / promise / read / cancel -> deactivate -> close

    =============  ============  ===================================================  =============
    call           node's        must                                                 may raise
    =============  ============  ===================================================  =============
    configure      configure     connect, check that the device answers and is the    DeviceError
                                 right one; no torque is possible yet
    activate       activate      enable the device at zero torque                     DeviceError
    begin          first horizon start a run: profiles adjoin from its first          DeviceError
                                 instant on
    schedule       goal          append a train to those before it; refuse one that   DeviceError,
                                 it cannot deliver, and change nothing                LimitError
    cancel         goal's cancel zero torque from now on, ready for another train     DeviceError
    promise        horizon       report the delivered torque                          DeviceError
    read           each promise  return the states since the last call                DeviceError
    stop           stop service  zero torque immediately, from any state and thread   nothing
    deactivate     deactivate    zero torque **before** disabling                     DeviceError
    close          cleanup       zero torque, disable, release everything             nothing
    =============  ============  ===================================================  =============

    After ``close`` the robot can be configured again: that is how to reconnect. ``stop`` and
    ``close`` may be called in any state, and more than once. After ``stop`` there must be no
    torque until ``close`` and ``configure``.

    **Time** is integer nanoseconds of the run's clock: simulated if ``capabilities.simulated`` is
    set, otherwise the wall clock, ``time.time_ns()``. Take its offset from steady time once, in
    ``begin``, because the wall clock may be adjusted during a run.

    **Promise**: ``promise(until)`` returns the delivered torque from the end of the last promise
    up to ``until`` or, if torque is known only afterwards, up to the last measurement before
    ``until``. It is binding: piecewise constant, adjoining, ascending, finite, never taken back.
    If nothing is known yet, ``valid_until`` equals its beginning.

    **Faults** are values in ``RobotState.faults``, not exceptions: an exception means that a call
    failed, a fault that something is wrong with the device. On a fault the driver brings the
    torque to zero by itself and reports the fault in every state until it is closed.

    **Threads**: the guard calls everything except ``stop`` from one thread. Calls return within
    10 ms (configure, activate, deactivate and close within 2 s), so nothing else has to wait. A
    driver that streams torque does so outside these calls: host_timed.py of
    gait_entrainment_drivers has a loop in its own process.

    **Safety**: a driver is never called directly. The guard (guard.py) wraps it: it checks every
    train against the limits, watches what is delivered, and brings the torque to zero on every
    exit path. A driver need not repeat that, except for what only it can detect: a device that no
    longer answers, and a host loop that runs late. Whatever happens to the process, the
    **device** must go to zero by itself when commands stop, because software on the host cannot
    do that. ``frozen`` lets the kit prove it.
    """

    Options: ClassVar[type[Any]]
    capabilities: Capabilities
    identity = ""  # what a configured device reports about itself, such as its firmware
    timing = LoopTiming()

    @abstractmethod
    def __init__(self, side: Side, options: Any, seed: int) -> None:
        """Keep the arguments; touch no hardware."""

    @abstractmethod
    def configure(self) -> None:
        """Connect; no torque is possible yet."""

    @abstractmethod
    def activate(self) -> None:
        """Enable the device at zero torque."""

    @abstractmethod
    def begin(self, start: int) -> None:
        """Start a run whose first profile begins at ``start`` [ns]."""

    @abstractmethod
    def schedule(self, train: PulseTrain) -> None:
        """Accept a train that the guard has checked; it follows those accepted before."""

    @abstractmethod
    def cancel(self) -> None:
        """Drop every train: torque is zero from now on."""

    @abstractmethod
    def promise(self, until: int) -> TorqueProfile:
        """Return the torque delivered since the last promise, up to ``until`` [ns] at most."""

    @abstractmethod
    def read(self) -> Sequence[RobotState]:
        """Return the states since the last call: finite, stamps ascending, none in the future."""

    @abstractmethod
    def stop(self) -> None:
        """Bring the torque to zero immediately and keep it there; never raises."""

    @abstractmethod
    def deactivate(self) -> None:
        """Bring the torque to zero, then disable the device."""

    @abstractmethod
    def close(self) -> None:
        """Bring the torque to zero, disable, release everything; never raises."""

    def frozen(self) -> AbstractContextManager[None]:
        """
        Return a context in which the host sends nothing to the device, as if it were frozen.

        Only the kit uses it, on an activated device in real time. Meanwhile it calls nothing but
        ``stop``, and the first command afterwards must be zero torque.
        """
        raise DeviceError("this driver cannot silence its host: implement AnkleRobot.frozen")
