# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Conducting a protocol: when to perturb, how far ahead to promise, when to end."""

from gait_entrainment.experiment.conductor import Conductor, Horizon, Phase
