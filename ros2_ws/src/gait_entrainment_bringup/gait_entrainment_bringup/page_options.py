# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The options of the operator's page, checked before anything starts."""

import argparse
import os
from typing import Any

from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import find_driver
from gait_entrainment.settings import Setting
from gait_entrainment_page.access import Access, listen

_PORT = Setting("port", kind=int, least=0, most=65535)


def add_page_options(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    group = parser.add_argument_group("the operator's page")
    group.add_argument(
        "--host", default="127.0.0.1", help="address to serve it at; any other needs a token"
    )
    group.add_argument("--port", default="8080", help="port to serve it at (8080); 0: a free one")
    group.add_argument(
        "--token",
        default="",
        help="lets its holder act; default: the one in ENTRAIN_PAGE_TOKENS, or a new one",
    )
    group.add_argument(
        "--heartbeat",
        action="store_true",
        help="the page is also the operator's sign of life: closing it ends torque",
    )
    group.add_argument(
        "--blinded", action="store_true", help="hide what would reveal the condition"
    )
    group.add_argument(
        "--foxglove", metavar="PORT", default="0", help="port to offer the same data to Foxglove"
    )


def check_heartbeat(options: argparse.Namespace, protocol: Protocol | None) -> None:
    """Raise UsageError if nothing would heed the page's heartbeat."""
    if options.heartbeat and (protocol is None or find_driver(protocol.driver).simulated):
        raise UsageError("--heartbeat: only a real robot heeds it; leave it out")


def checked_page(options: argparse.Namespace, protocol: Protocol | None) -> dict[str, Any]:
    """Return the node's parameters, and set its tokens in the environment; raises UsageError."""
    check_heartbeat(options, protocol)
    access = Access.of_environment(options.host, options.token)
    port = _PORT.parse("--port", options.port)
    foxglove = _PORT.parse("--foxglove", options.foxglove)
    if foxglove and options.blinded:
        raise UsageError("--foxglove: offers what a blinded session hides; leave it out")
    if foxglove:
        try:
            import foxglove as _  # noqa: F401, only to check that it is installed
        except ImportError:
            raise UsageError("--foxglove: needs its SDK: pip install foxglove-sdk") from None
        listen(options.host, foxglove, "--foxglove").close()
    with listen(options.host, port) as listener:
        port = listener.getsockname()[1]
    os.environ.update(access.environment)
    given = {name: getattr(options, name) for name in ("host", "heartbeat", "blinded")}
    return given | {"port": port, "foxglove": foxglove}
