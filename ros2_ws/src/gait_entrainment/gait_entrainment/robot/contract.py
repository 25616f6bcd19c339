# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a driver of an ankle robot must offer: the contract, for implementers and for the kit."""

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
    """What a device can do, known once its options are."""

    peak_torque: float  # [N m]; inf if it has no limit of its own
    torque_rate: float  # steepest change of torque [N m/s]; inf for a jump
    measures_torque: bool  # what read() reports is measured; else it is computed
    simulated: bool  # lives in simulated time: promises ahead, touches no clock and no person
    state_rate: float  # states per second [Hz]; 0 if there is one per change of torque
    torque_bandwidth: float = math.inf  # -3 dB: how fast its torque follows the command [Hz]

    def __post_init__(self) -> None:
        """Raise LimitError for what cannot be: a device is held against these."""
        for name in ("peak_torque", "torque_rate", "torque_bandwidth"):
            if not (value := getattr(self, name)) > 0:
                raise LimitError(f"capabilities.{name}: {value:g}; allowed: above 0")


@dataclass(frozen=True)
class RobotState:
    """The device at one instant."""

    stamp: int  # [ns], the clock of the run
    commanded: float  # torque that the device has been asked for [N m]
    measured: float  # torque that it measured [N m]; NaN if it measures none
    angle: float  # ankle angle that it measured [rad]; NaN if it measures none
    faults: tuple[Fault, ...] = ()  # what is wrong; empty when all is well


@dataclass
class LoopTiming:
    """How the loop that streams torque is doing."""

    refused: str = ""  # what the system did not permit it
    late: Sequence[float] = ()  # by how much its latest commands came late [s]


class AnkleRobot(ABC):
    """
    A driver of one ankle robot: every abstract method implemented, and this list kept.

    **Construction** ``(side, options, seed)``: keeps its arguments, sets ``capabilities``;
    touches no hardware. Options are a frozen dataclass, ``Options``, whose fields are made by
    ``settings.setting`` and are checked before construction; its ``__post_init__`` raises
    LimitError for what these cannot say.

    **Lifecycle**, mapped on the perturbator's lifecycle node::

        configure -> activate -> begin -> schedule / promise / read / cancel -> deactivate -> close

    =============  ============  ===================================================  =============
    call           node's        must                                                 may raise
    =============  ============  ===================================================  =============
    configure      configure     connect, check that the device answers and is the    DeviceError
                                 right one; no torque is possible yet
    activate       activate      enable the device at zero torque                     DeviceError
    begin          first horizon start the account of a run: profiles adjoin from     DeviceError
                                 its first instant on
    schedule       goal          take over a train, to follow those before; refuse    DeviceError,
                                 one that it cannot deliver, and change nothing       LimitError
    cancel         goal's cancel zero torque from now on, ready for another train     DeviceError
    promise        horizon       report the delivered torque                          DeviceError
    read           each promise  hand over the states since the last call             DeviceError
    stop           stop service  zero torque at once, from any state and thread       nothing
    deactivate     deactivate    zero torque **before** disabling                     DeviceError
    close          cleanup       zero torque, disable, release everything             nothing
    =============  ============  ===================================================  =============

    After ``close`` the robot can be configured again: that is how one reconnects. ``stop`` and
    ``close`` may be called in any state, more than once. After ``stop`` no torque may come until
    ``close`` and ``configure``.

    **Time** is integer nanoseconds of the run's clock: simulated if ``capabilities.simulated`` is
    set, otherwise the wall clock, ``time.time_ns()``. Take its offset to steady time once, in
    ``begin``: the wall clock may be set while you run.

    **Promise**: ``promise(until)`` returns the delivered torque from the end of the last promise
    up to ``until``, or, if it is known only afterwards, up to the last measurement before
    ``until``. It is binding: piecewise constant, adjoining, ascending, finite, never taken back.
    If nothing is known yet, ``valid_until`` equals its beginning.

    **Faults** are values in ``RobotState.faults``, not exceptions: an exception says that a call
    could not be done, a fault that something is wrong with the device. On a fault a driver brings
    the torque to zero by itself, and reports the fault with every state until it is closed.

    **Threads**: the guard calls everything but ``stop`` from one thread. Calls return within
    10 ms (configure, activate, deactivate and close within 2 s), so that nobody waits. A driver
    that streams torque does so in a thread of its own: host_timed.py of gait_entrainment_drivers
    has one.

    **Safety**: a driver is never called directly. The guard (guard.py) stands before it: it checks
    every train against the limits, watches what is delivered, and ends in zero torque on every
    way out. A driver need not repeat that, except for what only it can know: a device that no
    longer answers, and a host loop that runs late. Whatever happens to the process, the
    **device** must go to zero by itself when commands stop: software on the host cannot do that.
    ``frozen`` lets the kit prove it.
    """

    Options: ClassVar[type[Any]]
    capabilities: Capabilities
    identity = ""  # what a configured device says of itself, such as its firmware
    timing = LoopTiming()

    @abstractmethod
    def __init__(self, side: Side, options: Any, seed: int) -> None:
        """Keep the arguments; touch no hardware."""

    @abstractmethod
    def configure(self) -> None:
        """Connect; torque stays impossible."""

    @abstractmethod
    def activate(self) -> None:
        """Enable the device at zero torque."""

    @abstractmethod
    def begin(self, start: int) -> None:
        """Start a run whose first profile begins at ``start`` [ns]."""

    @abstractmethod
    def schedule(self, train: PulseTrain) -> None:
        """Take over a train that the guard has checked; it comes after those taken before."""

    @abstractmethod
    def cancel(self) -> None:
        """Drop every train: torque is zero from now on."""

    @abstractmethod
    def promise(self, until: int) -> TorqueProfile:
        """Return the delivered torque from the last promise on, up to ``until`` [ns] at most."""

    @abstractmethod
    def read(self) -> Sequence[RobotState]:
        """Return the states since the last call: finite, stamps ascending, none in the future."""

    @abstractmethod
    def stop(self) -> None:
        """Bring the torque to zero at once and keep it there; never raises."""

    @abstractmethod
    def deactivate(self) -> None:
        """Bring the torque to zero, then disable the device."""

    @abstractmethod
    def close(self) -> None:
        """Bring the torque to zero, disable, release everything; never raises."""

    def frozen(self) -> AbstractContextManager[None]:
        """
        Return a context in which the host is silent: nothing goes to the device, as if frozen.

        Only the kit asks for it, of a device in real time that has been activated. It calls
        nothing but ``stop`` meanwhile, and the first command afterwards must be zero torque.
        """
        raise DeviceError(
            "this driver cannot let its host fall silent: implement AnkleRobot.frozen"
        )
