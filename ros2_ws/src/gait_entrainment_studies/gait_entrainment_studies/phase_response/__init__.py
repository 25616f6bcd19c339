# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Response of the gait's timing to single pulses, and the lock that it predicts."""

from gait_entrainment_studies.phase_response.response import (
    PhaseResponse,
    Prediction,
    phase_response,
    predictions,
    single_pulse,
)

__all__ = ["PhaseResponse", "Prediction", "phase_response", "predictions", "single_pulse"]
