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

"""Ankle robot drivers by name."""

from gait_entrainment.device.ideal import IdealAnkleRobot
from gait_entrainment.device.limits import LimitError

DRIVERS = {"ideal": IdealAnkleRobot}


def find_driver(name: str) -> type[IdealAnkleRobot]:
    """
    Return the driver of a name.

    Raises
    ------
    LimitError
        where there is none, with the names that there are.

    """
    try:
        return DRIVERS[name]
    except KeyError:
        known = ", ".join(sorted(DRIVERS))
        raise LimitError(f"driver: {name!r} is unknown; allowed: {known}") from None
