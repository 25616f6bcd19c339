# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The gait: events and the strides they bound, pulse phases, phase lags, the entrainment verdict.

Nothing here depends on the walker: a person's signals take the same path as the model's.
"""

from gait_entrainment.gait.analyzer import Analysis, GaitAnalyzer, Hole, PulseCounts, analyze
from gait_entrainment.gait.drift import Drift, drift_of
from gait_entrainment.gait.plausibility import GaitLimits, GaitWatch
from gait_entrainment.gait.pulse_phase import PulsePhase
from gait_entrainment.gait.strides import EventCounts, GaitEvent, Stride, StrideTracker
from gait_entrainment.gait.verdict import Entrainment, Reason, Verdict, VerdictSettings
