# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One self-contained HTML page about runs: whether the data are sound, then what they show."""

from gait_entrainment_sessions.report.page import write_report
