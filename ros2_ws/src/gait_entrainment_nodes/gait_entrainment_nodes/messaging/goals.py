# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Pulses as the goal of an action; gait_entrainment_bags.messages converts the other way."""

from hashlib import sha256

from gait_entrainment.robot import PulseTrain
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_msgs.msg import Pulse
from gait_entrainment_nodes.messaging.stamps import to_time


def seal_of(key: str) -> str:
    """Return the public seal of the key that is required to request a run's pulses."""
    return sha256(key.encode()).hexdigest()


def goal_of(run: int, key: str, train: PulseTrain) -> DeliverPulseTrain.Goal:
    """Return the goal that requests the pulses of a train in a run, with the key of that run."""
    # The message has the fields of a pulse under the same names.
    pulses = [Pulse(**vars(pulse) | {"onset": to_time(pulse.onset)}) for pulse in train.pulses]
    return DeliverPulseTrain.Goal(run=run, key=key, side=train.side, pulses=pulses)
