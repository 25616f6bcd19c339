# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Pages as processes, and a browser's view of them, for the tests of the page."""

import http.client
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from harness import TIMEOUT, Started
from selenium.common.exceptions import StaleElementReferenceException, WebDriverException
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def request(port: int, path: str = "/", method: str = "GET", **headers: str) -> tuple[int, str]:
    """Send a request to a page; return status and text."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, headers=names)
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def until_served(port: int, *commands: Started) -> None:
    """Wait until a page is served, while the commands keep running."""
    deadline = time.monotonic() + TIMEOUT
    while time.monotonic() < deadline:
        for command in commands:
            assert command.process.poll() is None, command.text
        try:
            request(port)
            return
        except OSError:
            time.sleep(0.1)
    raise AssertionError(f"no page at port {port}: {[command.text for command in commands]}")


@contextmanager
def page(folder: Path, *options: str, port: int = 0, **environment: str) -> Iterator[Started]:
    """Start ``entrain page`` and wait until it serves; ``port`` of the result is its port."""
    port = port or free_port()
    environment.setdefault("ROS_DOMAIN_ID", "98")  # which no run of another test uses
    command = ["entrain", "page", f"--port={port}", *options]
    started: Any = Started(command, folder / f"page-{port}.out", **environment)
    started.port = port
    try:
        until_served(port, started)
        yield started
    finally:
        started.end()


class Look:
    """What a browser shows of a page."""

    def __init__(self, browser: Any, port: int) -> None:
        self.browser, self.port = browser, port
        browser.get(f"http://127.0.0.1:{port}/")

    @property
    def text(self) -> str:
        """All text that is shown; empty while the page loads."""
        try:
            return str(self.browser.find_element(By.TAG_NAME, "body").text)
        except (StaleElementReferenceException, WebDriverException):
            return ""

    def until(self, *words: str, timeout: float = TIMEOUT) -> str:
        """Wait until all words are shown; return the text."""
        deadline = time.monotonic() + timeout
        while not all(word in (text := self.text) for word in words):
            log = self.browser.get_log("browser") if time.monotonic() > deadline else []
            assert time.monotonic() < deadline, f"no {words} in:\n{text}\n{log}"
            time.sleep(0.05)
        return text

    def until_not(self, *words: str) -> None:
        """Wait until none of the words is shown."""
        deadline = time.monotonic() + TIMEOUT
        while any(word in (text := self.text) for word in words) or not text:
            assert time.monotonic() < deadline, f"{words} in:\n{text}"
            time.sleep(0.05)

    def click(self, words: str) -> None:
        """Click the button with these words, once it can be clicked."""
        self.until(words)
        path = f"//button[contains(., '{words}') and not(@disabled)]"
        deadline = time.monotonic() + TIMEOUT
        while not (found := self.browser.find_elements(By.XPATH, path)):
            assert time.monotonic() < deadline, f"{words} cannot be clicked:\n{self.text}"
            time.sleep(0.05)
        found[0].click()

    def press_stop(self, when: Callable[[], object]) -> int:
        """
        Press STOP once ``when`` returns true; return when the browser received it [ns].

        WebDriver adds a delay of its own, shorter if the pointer is already there.
        """
        self.browser.execute_script(
            "document.addEventListener('pointerdown', () => window.pressed = Date.now(),"
            " {capture: true, once: true})"
        )
        button = self.browser.find_element(By.ID, "stop")
        ActionChains(self.browser).move_to_element(button).perform()
        assert when(), self.text
        ActionChains(self.browser).click().perform()
        return int(self.browser.execute_script("return window.pressed")) * 10**6

    def type(self, words: str) -> None:
        """Type a note or a reason."""
        self.browser.find_element(By.CSS_SELECTOR, "input[maxlength='500']").send_keys(words)

    def note(self, words: str) -> None:
        """Type a note and send it."""
        self.type(words)
        self.click("Note it")
