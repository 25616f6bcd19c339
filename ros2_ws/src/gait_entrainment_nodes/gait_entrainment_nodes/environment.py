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

"""What the processes of a run share: environment and configuration files."""

import os
from pathlib import Path

from ament_index_python.packages import get_package_share_directory

from gait_entrainment_nodes.supervisor import PACKAGE


def config_file(name: str) -> Path:
    """Return the path of an installed file of config/."""
    return Path(get_package_share_directory(PACKAGE)) / "config" / name


def set_environment(domain: int) -> dict[str, str]:
    """
    Put this process into a ROS domain, and return the environment for those that it starts.

    What the user has set stays: the range of discovery, the profiles of Fast DDS.
    """
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(config_file("fastdds.xml")))
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    return dict(os.environ)
