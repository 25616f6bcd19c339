# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the processes of a run share: environment and installed files."""

import os
from pathlib import Path

from ament_index_python.packages import get_package_share_directory

PACKAGE = "gait_entrainment_nodes"


def shared_file(package: str, name: str) -> Path:
    """Return the path of a file that a package has installed in its share folder."""
    return Path(get_package_share_directory(package)) / name


def fastdds_profiles() -> Path:
    """Return the Fast DDS profiles that a run needs; the file says what for."""
    return shared_file(PACKAGE, "config/fastdds.xml")


def set_environment(domain: int) -> dict[str, str]:
    """
    Put this process into a ROS domain; return the environment for the processes it starts.

    The range of discovery and the Fast DDS profiles stay as the user has set them.
    """
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(fastdds_profiles()))
    # No node has large matrices: threads for them take longer to start than they save.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    return dict(os.environ)
