# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A real browser for tests: the system's headless Chromium, driven by Selenium.

    from browser import browser, chromium      # the fixture, or as many as a test wants

Without Chromium a test fails; it is not skipped, because what a person sees was not tested.
"""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium import webdriver

DESKTOP, TABLET = (1600, 1000), (1024, 768)
# Where Debian and Ubuntu put them.
_CHROMIUM, _DRIVER = "/usr/bin/chromium", "/usr/bin/chromedriver"


@contextmanager
def chromium(size: tuple[int, int] = DESKTOP, *options: str) -> Iterator[webdriver.Chrome]:
    """Yield a browser with a page of this size [px] and its own profile; fail without Chromium."""
    for program in (_CHROMIUM, _DRIVER):
        if shutil.which(program) is None:
            pytest.fail(f"{program} is missing: apt install chromium chromium-driver")
    chosen = webdriver.ChromeOptions()
    chosen.binary_location = _CHROMIUM
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        for option in (
            "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
            "--hide-scrollbars", "--no-first-run", "--disable-background-networking",
            f"--user-data-dir={Path(profile)}", *options,
        ):  # fmt: skip
            chosen.add_argument(option)
        driver = webdriver.Chrome(chosen, webdriver.ChromeService(_DRIVER))
        try:
            width, height = size
            # The size of the page, not of the window around it.
            driver.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
            )
            yield driver
        finally:
            driver.quit()


@pytest.fixture
def browser() -> Iterator[webdriver.Chrome]:
    """Yield a browser the size of a desktop."""
    with chromium() as driver:
        yield driver
