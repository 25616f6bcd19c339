# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What a command prints cannot control the terminal, whatever the names in a file contain."""

import io

from hypothesis import given
from hypothesis import strategies as st

from gait_entrainment_commands import main, simulate
from gait_entrainment_commands.printable import PrintableOutput, printable


@given(st.text())
def test_output_keeps_its_lines_and_printable_characters_and_escapes_all_others(text):
    stream = io.StringIO()
    print(text, file=PrintableOutput(stream))
    printed = stream.getvalue()
    assert all(c.isprintable() or c in "\n\t" for c in printed)
    assert printed.count("\n") == text.count("\n") + 1
    if all(c.isprintable() or c in "\n\t" for c in text):
        assert printed == text + "\n"


@given(st.text())
def test_printable_text_is_one_line(text):
    assert printable(text).isprintable()


def test_every_command_prints_such_output(monkeypatch, capsys):
    def run(options):
        print(f"a name that clears the screen: \x1b[2J{options.json}\u202e")
        return 0

    monkeypatch.setattr(simulate, "run", run)
    assert main(["simulate"]) == 0
    assert capsys.readouterr().out == ("a name that clears the screen: \\x1b[2JFalse\\u202e\n")
