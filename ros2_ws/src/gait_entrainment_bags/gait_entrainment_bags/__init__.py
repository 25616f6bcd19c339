# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Bags: recording MCAP files by rosbag2's rules, reading, checking, rescuing, exporting."""

from gait_entrainment_bags.checks import Finding, Severity, check
from gait_entrainment_bags.definitions import Definition, find_definition
from gait_entrainment_bags.errors import (
    BagError,
    BagExistsError,
    BagWriteError,
    DefinitionMissingError,
    DiskFullError,
    NoBagError,
    NothingToPlayError,
    UnreadableBagError,
)
from gait_entrainment_bags.mcap_records import BagMessage
from gait_entrainment_bags.metadata import INFINITE, QosProfile, TopicInfo
from gait_entrainment_bags.playback import FASTEST, Moment, Playback, choose_topics
from gait_entrainment_bags.reader import BagReader
from gait_entrainment_bags.recovery import Recovery, recover
from gait_entrainment_bags.tables import ExportError, export
from gait_entrainment_bags.writer import ENDED_EARLY, BagWriter
