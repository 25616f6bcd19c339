# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The command line ``entrain``: a table of commands, each loaded only when it is requested.

A package adds commands by the entry point ``gait_entrainment.commands``. It names a module with
``COMMANDS``, a mapping from command name to purpose. The command itself is the module of that
name in the same package:

    DESCRIPTION, EXAMPLES     text of ``entrain NAME --help``
    add_options(parser)       adds the options
    run(options) -> int       runs it and returns the exit code; a command with several actions
                              has no run, but sets it as a default of each action's parser

An EntrainmentError that a command raises is printed here, in one line.
"""

import argparse
import importlib
import io
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress
from typing import Any, NoReturn

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_commands.printable import PrintableOutput, printable
from gait_entrainment_commands.signals import stop_on_signals

ENTRY_POINTS = "gait_entrainment.commands"
COMMANDS = {
    "simulate": "the experiment in one process, without ROS",
}
# Where to look first: searching all packages takes longer than these commands; stop is urgent.
_FOUND_AT_ONCE = {"simulate": __name__, "stop": "gait_entrainment_drivers.commands"}
# From the very start, whatever ends these takes the same path as Ctrl-C: torque first, then the
# rest. If they were suspended, a robot would stay enabled.
_WITH_NODES_OR_ROBOT = ("driver", "node", "page", "preflight", "replay", "run", "session")
_DESCRIPTION = "Rehearse, run and analyze entrainment experiments."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return 0 if it succeeded, 1 if it failed, 2 for wrong usage."""
    output: Any = sys.stdout
    if isinstance(output, io.TextIOWrapper):  # None if it is closed
        output.reconfigure(errors="backslashreplace")  # characters that a terminal lacks
        output = PrintableOutput(output)
    os.environ.pop("MPLBACKEND", None)  # for windows, maybe unknown here: figures are files
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it works without a cache folder
    with redirect_stdout(output):
        return _run(sys.argv[1:] if arguments is None else list(arguments))


def _run(words: list[str]) -> int:
    name = words[0] if words else ""
    prog = f"entrain {name}"
    try:
        if name in _WITH_NODES_OR_ROBOT:
            stop_on_signals()
        options = make_parser(name).parse_args(words)
        prog = options.prog
        code = int(options.run(options))
        print(end="", flush=True)  # printed text that cannot be written is an error too
        return code
    except EntrainmentError as error:
        # One line, whatever names it contains, followed by the indented end of a node's log.
        reason, indented, log = str(error).partition("\n  ")
        _tell(f"{prog}: {printable(reason)}{indented}{log}")
        return error.exit_code
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        _tell(
            f"entrain: the Python package {package} is missing: run rosdep install, or "
            f"pip install {package} (docs/installation.md)"
        )
    except KeyboardInterrupt:
        _tell(f"{prog}: interrupted")
    except BrokenPipeError:
        pass
    except OSError as error:  # such as a folder that cannot be written
        where = f"{error.filename}: " if error.filename else ""
        _tell(f"{prog}: {where}{error.strerror or error}")
    finally:
        forget_unwritable_output()
    return 1


def _tell(line: str) -> None:
    """Print a line on standard error; if that is impossible, there is only the exit code."""
    with suppress(OSError):
        print(line, file=sys.stderr)


def forget_unwritable_output() -> None:
    """Keep Python from writing refused output again at exit, and from exiting with 120."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """
    A parser whose actions reject unknown arguments themselves, in one line.

    argparse leaves that to the top-level parser, and prints the usage first, which may fill the
    screen. The options' ``prog`` is the innermost parser's. Failing to write help is an error
    here; argparse ignores it.
    """

    def error(self, message: str) -> NoReturn:
        _tell(f"{self.prog}: {printable(message)}; see {self.prog} --help")
        raise SystemExit(2)

    def print_help(self, file: Any = None) -> None:
        print(self.format_help(), end="", file=file, flush=True)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        if "prog" not in options:
            options.prog = self.prog
        return options, unknown


def make_parser(name: str = "") -> argparse.ArgumentParser:
    """Return the parser of the command line; only the command of this name is loaded."""
    parser = _Parser(prog="entrain", description=_DESCRIPTION)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    package = _FOUND_AT_ONCE.get(name)
    packages = (
        {package: importlib.import_module(package).COMMANDS} if package else _find_packages()
    )
    for package, found in packages.items():
        for command, purpose in found.items():
            options = commands.add_parser(command, help=purpose)
            if command == name:
                add_command(options, f"{package}.{command.replace('-', '_')}")
    return parser


def add_command(parser: argparse.ArgumentParser, module_name: str) -> None:
    """Load the module of a command and let it fill its parser."""
    module = importlib.import_module(module_name)
    parser.description = module.DESCRIPTION
    parser.epilog = getattr(module, "EXAMPLES", None)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    module.add_options(parser)
    if hasattr(module, "run"):
        parser.set_defaults(run=module.run)


def _find_packages() -> dict[str, dict[str, str]]:
    """Return the commands and their purposes by package."""
    # Not at the top: commands that are found without a search do not need it.
    from importlib.metadata import entry_points

    points = sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name)
    packages = {__name__: COMMANDS}
    for point in points:
        try:
            packages[point.value] = dict(point.load().COMMANDS)
        except (Exception, SystemExit) as error:  # not this project's; the other ones work
            message = f"entrain: the commands of {point.value} cannot be loaded: {error!r}"
            print(message, file=sys.stderr)
    return packages
