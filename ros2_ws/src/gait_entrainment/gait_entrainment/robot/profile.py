# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A torque profile: what an ankle robot promises to deliver up to an instant."""

from dataclasses import dataclass

from gait_entrainment.conventions import Side


@dataclass(frozen=True)
class TorqueProfile:
    """
    Piecewise-constant delivered torque, and the promise that nothing before its end changes.

    ``torques[i]`` [N m] holds on ``[times[i], times[i + 1])``, the last one up to
    ``valid_until`` [ns]. Profiles adjoin: ``times[0]`` is the ``valid_until`` of the one before.
    """

    side: Side
    times: tuple[int, ...]
    torques: tuple[float, ...]
    onsets: tuple[int, ...]  # of the pulses that begin in this profile [ns]
    valid_until: int
