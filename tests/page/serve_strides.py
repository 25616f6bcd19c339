# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Serve a page of a walk of 10,000 strides: 100, then 9,900 more as soon as a line is read.

    python serve_strides.py PORT
"""

import sys
import threading
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "ros2_ws/src/gait_entrainment_page/test"))
from test_view import walk

from gait_entrainment_page.access import Access, Seat, listen
from gait_entrainment_page.layout import Page
from gait_entrainment_page.view import View

view, port = View(), int(sys.argv[1])
walk(view, 1, 100, 10_000)
page = Page(lambda: view, Seat(1.0), Access("127.0.0.1"), listen("127.0.0.1", port))
sys.stdin.readline()
for number in range(101, 10_001):
    with view.lock:
        walk(view, number, number, 10_000, readings=2)
threading.Event().wait()
