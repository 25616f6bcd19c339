# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
entrain results: the page of results, made by the commands that it contains.

Its template is `results.md` next to this module. Each command's output is put below its line, and
the figures shown are put into a folder, those of a sweep with the table they are drawn from.
"""

import argparse
import contextlib
import io
import re
import shutil
import sys
import tempfile
from pathlib import Path

from gait_entrainment.errors import EntrainmentError
from gait_entrainment_commands import main

DESCRIPTION = "Run the commands of the page of results and write results.md with its figures."
EXAMPLES = "examples:\n  entrain results --out docs"

TEMPLATE = Path(__file__).with_suffix(".md")
COMMAND = re.compile(r"^    entrain (.*)\n", re.MULTILINE)
FIGURE = re.compile(r"\]\(results/(\d+_(.*)\.png)\)")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--out", type=Path, default=Path("docs"), metavar="DIR", help="default docs"
    )


def run(options: argparse.Namespace) -> int:
    """Run every command of the page; raises EntrainmentError if one fails."""
    figures = options.out / "results"
    figures.mkdir(parents=True, exist_ok=True)
    # Text before the first command, then alternately a command and the text after it.
    page, *rest = COMMAND.split(TEMPLATE.read_text(encoding="utf-8"))
    for command, text in zip(rest[::2], rest[1::2], strict=True):
        print(f"entrain {command}", file=sys.stderr)
        with tempfile.TemporaryDirectory() as folder:
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                status = main([*command.split(), "--out", folder])
            if status != 0:
                raise EntrainmentError(f"entrain {command} failed")
            page += f"    entrain {command}\n\n{_shown(output.getvalue())}\n{text}"
            for drawn, name in FIGURE.findall(text):
                for kind in (".png", ".parquet"):
                    if (file := Path(folder) / f"{name}{kind}").exists():
                        shutil.copyfile(file, (figures / drawn).with_suffix(kind))
    (options.out / "results.md").write_text(page, encoding="utf-8")
    print(f"written          {options.out / 'results.md'}")
    return 0


def _shown(output: str) -> str:
    """Return a command's output without the files it lists, as a block unless it has a table."""
    lines = [
        line for line in output.splitlines() if not line.startswith(("figure  ", "written  "))
    ]
    text = "\n".join(lines).strip()
    return text if "| --- |" in text else f"```text\n{text}\n```"
