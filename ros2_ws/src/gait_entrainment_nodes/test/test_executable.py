# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the executable of a node does with signals and a closed output, from its start on."""

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
    """Return what runs ``main`` of a node in this process, and undo what that does to it."""
    handlers = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}

    def of(main):
        module = ModuleType("nodes.some_node")
        module.main = main
        monkeypatch.setattr(sys, "argv", ["/lib/some_node"])
        monkeypatch.setitem(sys.modules, "nodes", ModuleType("nodes"))
        monkeypatch.setitem(sys.modules, "nodes.some_node", module)
        return executable.main("nodes")

    yield of
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_a_second_interrupt_does_not_break_into_the_end(run):
    assert run(lambda: 1) == 1
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN


def test_who_has_read_enough_of_the_help_is_told_nothing(run, capsys):
    def main():
        raise BrokenPipeError

    assert run(main) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_node_is_loaded_ends_it_at_once(run, number, monkeypatch, capsys):
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
