# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Signals in closed form of feet with known events."""

import math

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment_sensors.detection import Detection

STRIDE, STANCE = 1.1, 0.68  # s
OFFSET = {Side.RIGHT: 0.5, Side.LEFT: 0.5 + STRIDE / 2}  # first heel strike [s]


def fed(detector, samples):
    return [found for time, values in samples for found in detector.add(time, values)]


def times(detections, kind):
    return [d.time for d in detections if d.kind is kind]


def sampled(signal, until, rate=200.0, start=0.0):
    count = int((until - start) * rate)
    return [(start + n / rate, signal(start + n / rate)) for n in range(count)]


def force(time, side=Side.RIGHT, peak=800.0):
    """Vertical force: in stance a half-sine, so events are where it leaves zero."""
    phase = (time - OFFSET[side]) % STRIDE
    loaded = time >= OFFSET[side] and phase < STANCE
    return peak * math.sin(math.pi * phase / STANCE) if loaded else 0.0


def foot_rate(time, side=Side.RIGHT):
    """
    Sagittal rate of a foot, toes down positive [rad/s].

    The foot slaps flat within 0.1 s of the strike. In the last 0.15 s of stance it turns down ever
    faster; after toe-off the rate falls within 20 ms. The swing is a sine that ends at zero.
    """
    phase = (time - OFFSET[side]) % STRIDE
    if time < OFFSET[side] + 0.1:  # standing before
        return 0.0
    if phase < 0.1:
        return 4.0 * math.sin(math.pi * phase / 0.1)
    if STANCE - 0.15 < phase <= STANCE:
        return 7.0 * (phase - STANCE + 0.15) / 0.15
    if STANCE < phase <= STANCE + 0.02:
        return 7.0 * (1 - (phase - STANCE) / 0.02)
    if phase > STANCE:
        return -5.0 * math.sin(math.pi * (phase - STANCE - 0.02) / (STRIDE - STANCE - 0.02))
    return 0.0


def detections(strides, stride=STRIDE, stance=STANCE, latency=0.02):
    """Return the detections of a perfect detector for both feet, in order."""
    found = []
    for side in Side:
        for n in range(strides):
            strike = OFFSET[side] + n * stride
            toe_off = strike + stance
            found.append(Detection(EventKind.HEEL_STRIKE, side, strike, strike + latency, 0.0))
            found.append(Detection(EventKind.TOE_OFF, side, toe_off, toe_off + latency, 0.0))
    return sorted(found, key=lambda d: d.detected_at)
