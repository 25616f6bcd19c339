# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Make the pictures of docs/page.md: a real run with an emulated motor, as a browser shows it.

    python tests/page/make_pictures.py        page_desktop.png and page_tablet.png in docs/figures

The walk is that of the paper in real time, so it takes two minutes. The script needs root, as the
pictures must show operator@lab and no real operator or computer.
"""

import ctypes
import os
import socket
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / name) for name in ("page", ".", "system")]
_CLONE_NEWUTS = 0x04000000  # a separate host name
os.environ["LOGNAME"] = "operator"
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

from browser import TABLET, chromium  # noqa: E402
from harness import entrain_run  # noqa: E402
from pages import Look, free_port, until_served  # noqa: E402
from test_drivers import emulated_motor  # noqa: E402

from gait_entrainment_drivers.proof import keep_proof  # noqa: E402

FIGURES = ROOT / "docs/figures"
# The pictures are taken in this stride, after the gait has locked and a pulse has come.
SHOWN = 48
DESKTOP = (1440, 900)


def main() -> None:
    """Take the pictures."""
    if ctypes.CDLL(None).unshare(_CLONE_NEWUTS):
        sys.exit("make_pictures: needs root")
    socket.sethostname("lab")
    port = free_port()
    walk = ("--real-time", "--arm", "--baseline=10", "--pulses=60", "--washout=10")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        os.environ["XDG_STATE_HOME"] = folder
        with (
            emulated_motor(place) as (driver, _),
            chromium(DESKTOP) as desktop,
            chromium(TABLET) as tablet,
            ExitStack() as running,
        ):
            keep_proof(driver, 0.1)
            options = (f"--driver={driver}", *walk, "--page", f"--port={port}")
            run = running.enter_context(entrain_run(place / "bag", *options))
            until_served(port, run)
            shown = {"desktop": Look(desktop, port), "tablet": Look(tablet, port)}
            shown["desktop"].note("harness fitted, treadmill at 1.1 m/s")
            for name, look in shown.items():
                look.until(f"{SHOWN} of 80", timeout=150)
                look.browser.save_screenshot(str(FIGURES / f"page_{name}.png"))


if __name__ == "__main__":
    main()
