# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the executable of each node runs: the node of its own name, if ROS can start here."""

import importlib
import sys

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_nodes.messaging.environment import PACKAGE, require_usable_environment


def main(package: str = f"{PACKAGE}.nodes") -> int:
    """Run the node, a module of the package, to its end and return its exit code."""
    name = sys.argv[0].rpartition("/")[2]
    try:
        require_usable_environment()
        return int(importlib.import_module(f"{package}.{name}").main())
    except (EntrainmentError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:  # before the node could take it as a request to stop
        return 0
