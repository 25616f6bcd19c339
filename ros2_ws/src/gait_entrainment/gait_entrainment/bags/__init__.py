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

"""Bags: recording into MCAP with rosbag2's rules, reading, checking, rescuing, exporting."""

from gait_entrainment.bags.checks import Finding, Severity, check
from gait_entrainment.bags.definitions import Definition, find_definition
from gait_entrainment.bags.errors import (
    BagError,
    BagExistsError,
    BagWriteError,
    DefinitionMissingError,
    DiskFullError,
    UnreadableBagError,
)
from gait_entrainment.bags.mcap_file import BagMessage
from gait_entrainment.bags.metadata import INFINITE, QosProfile, TopicInfo
from gait_entrainment.bags.playback import FASTEST, Moment, Playback, choose_topics
from gait_entrainment.bags.reader import BagInfo, BagReader, info
from gait_entrainment.bags.recovery import Recovery, recover
from gait_entrainment.bags.tables import export
from gait_entrainment.bags.writer import ENDED_EARLY, BagWriter

__all__ = [
    "BagWriter",
    "ENDED_EARLY",
    "BagReader",
    "BagMessage",
    "BagInfo",
    "info",
    "check",
    "Finding",
    "Severity",
    "recover",
    "Recovery",
    "export",
    "Playback",
    "Moment",
    "FASTEST",
    "choose_topics",
    "TopicInfo",
    "QosProfile",
    "INFINITE",
    "Definition",
    "find_definition",
    "BagError",
    "BagExistsError",
    "UnreadableBagError",
    "DefinitionMissingError",
    "BagWriteError",
    "DiskFullError",
]
