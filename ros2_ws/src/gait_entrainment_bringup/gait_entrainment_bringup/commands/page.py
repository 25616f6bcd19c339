# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain page: a run in a browser, with a stop that works."""

import argparse
import importlib
import signal
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from pathlib import Path
from urllib.parse import urlsplit

from gait_entrainment.errors import UsageError
from gait_entrainment_bringup.node_list import PAGE, parameter_arguments
from gait_entrainment_bringup.page_options import add_page_options, checked_page
from gait_entrainment_bringup.run_options import (
    SESSION_FILE,
    add_run_options,
    checked_run,
    checked_session,
)
from gait_entrainment_nodes.messaging.domain import claimed_domain, wanted_domain
from gait_entrainment_nodes.messaging.environment import set_environment
from gait_entrainment_page.access import Access, Seat, listen
from gait_entrainment_sessions.runs import is_sealed

DESCRIPTION = (
    "Show a live run, a replay or a recorded bag in a browser, and let the operator act: "
    "preflight, start, arm, note, stop. The other options are those of the run that it may start."
    " It is no substitute for a hand-held switch: see docs/safety.md."
)
EXAMPLES = """examples:
  entrain page protocol.yaml --real-time        then start the run from the page
  entrain page --session session.yaml --real-time      the same with a session
  entrain page --bag bags/paper_example         a recorded bag, at any time in it
  ROS_DOMAIN_ID=42 entrain page                 alongside a run or a replay in that domain
  entrain run --real-time --page                a run with its page
  entrain page --host 0.0.0.0                   for a tablet: with tokens for acting and viewing
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_run_options(parser)
    add_page_options(parser)
    parser.add_argument("--bag", type=Path, help="show a bag instead of a live run")
    parser.add_argument("--session", action="store_true", help=SESSION_FILE)
    parser.add_argument("--open", action="store_true", help="open the page in a browser here")


def run(options: argparse.Namespace) -> int:
    """Serve the page until it is stopped."""
    if options.bag is not None:
        return show_bag(options)
    if options.session:
        session = checked_session(options.protocol, options)
        protocol = session.blocks[0].protocol
        options.blinded |= session.blind
    else:
        protocol, _ = checked_run(options, records=False)
    given = checked_page(options, protocol)
    # The run that the page starts claims the domain itself.
    domain = wanted_domain()
    if domain is None:
        with claimed_domain() as domain:
            pass
    set_environment(domain, real_time=options.real_time)
    given |= {"command": run_words(options), "record": str(Path.cwd()), "use_sim_time": False}
    if options.open:
        address = (options.host, given["port"])
        threading.Thread(target=open_browser, args=address, daemon=True).start()
    with tempfile.TemporaryDirectory(prefix="entrain_") as folder:
        sys.argv = [PAGE, *parameter_arguments({PAGE: given}, Path(folder))]
        return int(importlib.import_module(f"gait_entrainment_page.{PAGE}").main())


def show_bag(options: argparse.Namespace) -> int:
    """Serve the page of a bag, without ROS, until it is stopped."""
    from gait_entrainment_page.bag_source import BagSource

    if not options.bag.exists():
        raise UsageError(f"{options.bag}: no such file or folder")
    if options.foxglove != "0":
        raise UsageError("--foxglove: offers a live run; Foxglove opens a bag by itself")
    bag = BagSource(options.bag, blinded=options.blinded or is_sealed(options.bag))
    given = checked_page(options, None)
    from gait_entrainment_page.layout import Page  # not at the top: it loads the web server

    access = Access.of_environment(options.host)
    listener = listen(options.host, given["port"])
    page = Page(lambda: bag.view, Seat(1.0), access, listener, bag=bag)
    if options.open:
        open_browser(options.host, given["port"])
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    ended.wait()
    page.close()
    bag.close()
    return 0


def run_words(options: argparse.Namespace) -> list[str]:
    """Return the command that the page may start; an empty word if none."""
    known = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    add_page_options(known)
    known.add_argument("--bag")
    for option in ("--open", "--session"):
        known.add_argument(option, action="store_true")
    place = sys.argv.index("page") + 1
    _, words = known.parse_known_args(sys.argv[place:])
    if not words:
        return [""]
    return ["session" if options.session else "run", *words]


def open_browser(host: str, port: int) -> None:
    """Open the page in a browser once it is served; report it if there is no browser."""
    *_, (_, address) = Access.of_environment(host).addresses(port)  # the last one is for acting
    while True:
        try:
            socket.create_connection((urlsplit(address).hostname, port), 1.0).close()
            break
        except OSError:
            time.sleep(0.1)
    if not webbrowser.open(address):
        print(f"entrain page: no browser was found: open {address} in one", file=sys.stderr)
