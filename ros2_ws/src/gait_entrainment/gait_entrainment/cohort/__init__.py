# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A cohort of simulated subjects, each taken through the experiment of the human study."""

from gait_entrainment.cohort.study import (
    Study,
    StudyPlan,
    Trial,
    measured_basin_percent,
    run_study,
    table_1_subjects,
    verdicts,
)
from gait_entrainment.cohort.subjects import SubjectDistributions, Subjects, draw_subjects

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
