# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options of the page: ports in use, tokens, and a computer without a browser."""

import argparse
import os

import pytest

from gait_entrainment.errors import UsageError
from gait_entrainment_bringup.commands import page
from gait_entrainment_bringup.page_options import add_page_options, checked_page
from gait_entrainment_page.access import listen


@pytest.mark.parametrize("option", ["--port", "--foxglove"])
def test_a_port_in_use_is_reported_with_its_option(option):
    with listen("127.0.0.1", 0) as listener:
        taken = listener.getsockname()[1]
        parser = argparse.ArgumentParser()
        add_page_options(parser)
        options = parser.parse_args(["--port=0", f"{option}={taken}"])
        with pytest.raises(UsageError, match=f"^{option}: {taken} is taken by another program"):
            checked_page(options, None)


def test_tokens_of_the_environment_are_kept_unless_one_is_chosen(monkeypatch):
    monkeypatch.setenv("ENTRAIN_PAGE_TOKENS", "letmeactnow letmelookon more")
    parser = argparse.ArgumentParser()
    add_page_options(parser)
    checked_page(parser.parse_args(["--port=0", "--host=0.0.0.0"]), None)
    assert os.environ["ENTRAIN_PAGE_TOKENS"] == "letmeactnow letmelookon"
    checked_page(parser.parse_args(["--port=0", "--token=nowthisone"]), None)
    assert os.environ["ENTRAIN_PAGE_TOKENS"].startswith("nowthisone ")


def test_without_a_browser_the_address_is_printed(monkeypatch, capsys):
    monkeypatch.setattr(page.webbrowser, "open", lambda address: False)  # noqa: ARG005
    monkeypatch.setenv("ENTRAIN_PAGE_TOKENS", "letmeactnow letmelookon")
    with listen("127.0.0.1", 0) as listener:
        port = listener.getsockname()[1]
        page.open_browser("127.0.0.1", port)
    address = f"http://127.0.0.1:{port}/?token=letmeactnow"
    assert capsys.readouterr().err.endswith(f"no browser was found: open {address} in one\n")
