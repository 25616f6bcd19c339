# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A cohort of simulated subjects, each taken through the experiment of the human study."""

from gait_entrainment_studies.cohort.study import (
    Study,
    StudyPlan,
    Trial,
    measured_basin_percent,
    run_study,
    table_1_subjects,
    verdicts,
)
from gait_entrainment_studies.cohort.subjects import SubjectDistributions, Subjects, draw_subjects

__all__ = [
    "Study",
    "StudyPlan",
    "SubjectDistributions",
    "Subjects",
    "Trial",
    "draw_subjects",
    "measured_basin_percent",
    "run_study",
    "table_1_subjects",
    "verdicts",
]
