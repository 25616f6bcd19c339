# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``entrain``, also ``python -m gait_entrainment``."""

import sys

from gait_entrainment.commands import main

if __name__ == "__main__":
    sys.exit(main())
