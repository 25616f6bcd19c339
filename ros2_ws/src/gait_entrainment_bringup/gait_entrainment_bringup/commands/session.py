# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain session: the blocks of a session one after the other, each a run with a bag."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment_bags import BagError
from gait_entrainment_bringup.commands.run import add_node_options, check_nodes, start_page
from gait_entrainment_bringup.node_list import PAGE, Parameters, parameter_arguments
from gait_entrainment_bringup.run_options import add_conduct_options, checked_session
from gait_entrainment_bringup.session_run import SessionRun
from gait_entrainment_bringup.supervisor import supervised
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_sessions.dataset import complete
from gait_entrainment_sessions.folder import SessionFolder
from gait_entrainment_sessions.runs import read_runs
from gait_entrainment_sessions.session_file import Session
from gait_entrainment_sessions.tables import FORMATS, write_tables

DESCRIPTION = (
    "Conduct the blocks of a session file, with rests between them, into one folder. The same "
    "command resumes a session that was paused or interrupted, at the block where it stopped; "
    "nothing is overwritten. At a terminal it asks before each block: Enter goes on, p REASON "
    "pauses, r REASON repeats the block before, n TEXT adds a note. With --page this is done on "
    "the page instead."
)
EXAMPLES = """examples:
  entrain session session.yaml                 simulated, as fast as possible, without rests
  entrain session session.yaml --real-time --arm
  entrain session session.yaml --real-time --arm-later --page     pause, repeat and arm from there
  entrain session session.yaml --repeat 2 --reason "the treadmill stopped"
  entrain session unblind STUDY/sub-P01/ses-1  break the seal of a blinded session
  entrain session export STUDY --out tables --format parquet    all its sessions together
"""
DESK = "session_desk"
_ACTIONS = {"unblind": "break the seal", "export": "write tables of all runs in a folder"}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    text = "; ".join(f"{name}: {purpose}" for name, purpose in _ACTIONS.items())
    parser.add_argument("action", nargs="?", choices=_ACTIONS, help=text)
    parser.add_argument(
        "path", type=Path, metavar="SESSION.yaml", help="with an action: a folder instead"
    )
    add_conduct_options(parser, "folder of the study, or of the tables; default sessions/<study>")
    add_node_options(parser)
    parser.add_argument("--repeat", type=int, metavar="BLOCK", help="repeat a block, from 1")
    parser.add_argument("--reason", default="", help="why to repeat it, for the ledger")
    parser.add_argument("--note", default="", metavar="TEXT", help="write this into the ledger")
    parser.add_argument("--no-rest", action="store_true", help="do not wait between blocks")
    parser.add_argument(
        "--format", choices=FORMATS, default="tsv", help="format of an export; default tsv"
    )


def run(options: argparse.Namespace) -> int:
    """Conduct a session, unblind it, or export tables."""
    if options.action == "unblind":
        folder = SessionFolder(options.path)
        for number, name in enumerate(folder.unblind(), start=1):
            print(f"block {number}          {name}")
        _print_paths(complete(folder))
        return 0
    if options.action == "export":
        if options.out is None:
            raise UsageError("--out: missing; allowed: a folder for the tables")
        _print_paths(write_tables(read_runs(options.path), options.out, options.format))
        return 0
    return _conduct(checked_session(options.path, options), options)


@contextmanager
def _at_hand(folder: SessionFolder, domain: int, options: argparse.Namespace) -> Iterator[None]:
    """Run the operator's side of a session in its domain: the node `session`, and the page."""
    # Not the name of the process: its services are to be `session/pause` and the like.
    given: Parameters = {"session": {"folder": str(folder.path.absolute())}}
    if options.page:
        given[PAGE] = {"record": str(folder.path), "use_sim_time": not options.real_time}
        given[PAGE] |= options.page_parameters
    with supervised(domain, (PAGE, DESK), real_time=options.real_time) as supervisor:
        arguments = parameter_arguments(given, supervisor.folder)
        supervisor.start(DESK, arguments, "gait_entrainment_bringup")
        if options.page:
            start_page(supervisor, arguments, options)
        yield


def _conduct(session: Session, options: argparse.Namespace) -> int:
    options.blinded |= session.blind  # so that a page hides the condition too
    check_nodes(options, session.blocks[0].protocol)
    if options.repeat is not None and not options.reason:
        raise UsageError("--reason: missing; a repetition needs one")
    study = options.out or Path("sessions") / session.study
    folder = SessionFolder.begin(study, session)
    with folder.held(), claimed_domain() as domain:
        try:
            with _at_hand(folder, domain, options):
                SessionRun(session, folder, options, domain).conduct()
        except BaseException:
            with suppress(BagError, OSError):  # the reason why it ended is what counts
                _complete(folder)
            raise
        tables = _complete(folder)
    print(f"session          {folder.path}")
    _print_paths(tables)
    return 0


def _complete(folder: SessionFolder) -> list[Path]:
    return complete(folder) if folder.runs() else []


def _print_paths(paths: list[Path]) -> None:
    for path in paths:
        print(f"table            {path}")
