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

"""Between ROS stamps and the core's integer nanoseconds."""

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND


def to_nanoseconds(stamp: Time) -> int:
    """Return a ROS stamp as integer nanoseconds since 1970."""
    return stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec


def to_time(nanoseconds: int) -> Time:
    """Return integer nanoseconds since 1970 as a ROS stamp."""
    sec, nanosec = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    return Time(sec=sec, nanosec=nanosec)


def header(nanoseconds: int) -> Header:
    """Return a header with a stamp; no frame: what is sent here has no place in space."""
    return Header(stamp=to_time(nanoseconds))
