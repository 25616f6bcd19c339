# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What each node's executable runs: the node of the same name, if ROS can start here."""

import importlib
import os
import signal
import sys

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_commands import forget_unwritable_output
from gait_entrainment_nodes.messaging.environment import PACKAGE, require_usable_environment


def main(package: str = f"{PACKAGE}.nodes") -> int:
    """Run the node, a module of the package, to its end and return its exit code."""
    name = sys.argv[0].rpartition("/")[2]
    for number in (signal.SIGINT, signal.SIGTERM):  # nothing is open while the node loads
        signal.signal(number, lambda *_: os._exit(0))
    try:
        require_usable_environment()
        return int(importlib.import_module(f"{package}.{name}").main())
    except BrokenPipeError:  # the reader of the help has read enough
        forget_unwritable_output()
        return 0
    except (EntrainmentError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    finally:
        # Launch sends a second one, and Python restores the default at exit, which would kill it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
