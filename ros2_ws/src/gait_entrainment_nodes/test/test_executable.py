# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How a node's executable handles signals and a closed output, right from its start."""

import os
import signal
import sys
from types import ModuleType

import pytest

from gait_entrainment_nodes import executable


class LeftError(BaseException):
    """The process would have ended here."""


@pytest.fixture
def run(monkeypatch):
    """Return a function that runs a node's ``main`` in this process; undo its changes later."""
    handlers = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}

    def run_main(main):
        module = ModuleType("nodes.some_node")
        module.main = main
        monkeypatch.setattr(sys, "argv", ["/lib/some_node"])
        monkeypatch.setitem(sys.modules, "nodes", ModuleType("nodes"))
        monkeypatch.setitem(sys.modules, "nodes.some_node", module)
        return executable.main("nodes")

    yield run_main
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_a_second_interrupt_does_not_disturb_the_shutdown(run):
    assert run(lambda: 1) == 1
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN


def test_closing_the_output_of_the_help_is_not_reported(run, capsys):
    def main():
        raise BrokenPipeError

    assert run(main) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_node_is_loaded_ends_it_immediately(run, number, monkeypatch, capsys):
    def leave(code):
        raise LeftError(code)

    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr(
        executable.importlib, "import_module", lambda _: os.kill(os.getpid(), number)
    )
    with pytest.raises(LeftError) as left:
        run(lambda: 0)
    assert left.value.args == (0,)
    assert capsys.readouterr() == ("", "")
