# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain results: the page of results, made by the commands that it names."""

import argparse
import contextlib
import io
import shutil
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Section:
    """One part of the page: what it says, and the command whose output follows."""

    title: str
    text: str
    arguments: tuple[str, ...]
    figures: tuple[str, ...]


SECTIONS = (
    Section(
        "The paper's numbers and figures",
        "Every number that is printed, beside ours. Four differ. Three of them (peak torque,"
        " smallest force, stride period of Fig. 7) come out as printed if k and mu are what Table"
        " 1 may have been rounded from, both together and neither alone. The fourth, the basin,"
        " is an open interval for us; on a grid of 4 ms its width is the printed 3.93 %. That the"
        " authors used such a grid is our conclusion, not their statement. 'Less than 9 %' in"
        " Fig. 8 holds for a pulse in every stride and is tight for a pulse in every step: both"
        " are given. Figures 4 to 8 follow the paper's layout.",
        ("paper",),
        ("figure_4", "figure_5", "figure_6b", "figure_7", "figure_8"),
    ),
    Section(
        "Locked gaits, solved",
        "All 1:1 phase-locked gaits, stable or not. Along a branch the period is a smooth function"
        " of where the pulse lies, so the borders of the basin are corners or folds, and each is"
        " solved for. At 2 tau_0 - 50 ms one lock draws every initial phase.",
        ("lock",),
        ("locked_gaits",),
    ),
    Section(
        "Two attractors",
        "In the narrow band that the paper calls unimportant a second lock, early in double"
        " stance, coexists and draws a few of the initial phases.",
        ("lock", "--period-offset", "-0.067", "--phases", "256"),
        (),
    ),
    Section(
        "A lock that no initial phase finds",
        "Near the corner at toe-off, at higher torque, a lock can be stable and still be reached"
        " from none of the initial phases: arriving from swing, the pulses step over it.",
        ("lock", "--torque-fraction", "0.135", "--period-offset", "-0.10444"),
        (),
    ),
    Section(
        "Existence of the gait",
        "Below the lower stiffness the walker falls, above the upper one the leading leg lifts.",
        ("existence",),
        ("existence",),
    ),
    Section(
        "Phase response",
        "How much a single pulse advances all later heel strikes, and the lock that this predicts"
        " where the advance makes up for the difference of the periods. The prediction neglects"
        " what a pulse leaves for the next stride.",
        (
            "phase-response",
            *("--period-offset", "-0.075", "--period-offset", "-0.05"),
            *("--period-offset", "-0.02"),
        ),
        ("phase_response",),
    ),
    Section(
        "Arnold tongue",
        "Two maps that are not mixed: a stable 1:1 lock exists (solved), and the share of initial"
        " phases locked by stride 100 (walked). Where walking can tell, the two differ only in"
        " cells like the one above, whose lock no initial phase finds. At high torque the lock"
        " turns unstable by a flip next to 2 tau_0: strides alternate, and further in they stay"
        " bound to the pulses without repeating.",
        ("sweep",),
        ("tongue",),
    ),
    Section(
        "Extension: pulses to dorsiflexion",
        "Negative torque slows the walker and entrains it to longer periods, at the beginning or"
        " in the middle of double stance. Humans entrain to longer periods too, but to"
        " plantarflexion pulses and at push-off: that the model does not explain.",
        (
            "sweep",
            *("--torque-fractions", "-0.2", "0.2", "41", "--period-offsets", "-0.15", "0.15"),
            *("61", "--phases", "8", "--strides", "150"),
        ),
        ("tongue", "locked_lags"),
    ),
    Section(
        "Extension: a cohort",
        "The human study's experiment on simulated subjects with stride-to-stride variability."
        " With the assumed variation of 2 % with long-range correlation, less than half of the"
        " subjects are shown to be entrained at any one period by our verdict, which asks for more"
        " than a slope that does not differ from zero, and none to longer periods. The"
        " distributions are our assumptions.",
        ("cohort",),
        ("cohort",),
    ),
    Section(
        "Extension: a cohort with little variability",
        "The same subjects with a tenth of the variation: what is lost above is lost to noise.",
        ("cohort", "--variation", "0.002", "0.0005"),
        (),
    ),
    Section(
        "Extension: a slope",
        "The same with little variability on ground that falls by 0.02 rad.",
        (
            "cohort",
            *("--variation", "0.002", "0.0005", "--slope", "-0.02"),
            *("--period-offset", "-0.05"),
        ),
        (),
    ),
)

_HEADING = """# Results

Written by `entrain results`; every block is the output of the command above it. The walker is that
of Table 1 unless a command says otherwise.
"""

DESCRIPTION = "Run the commands that the page names and write results.md with its figures."
EXAMPLES = "examples:\n  entrain results --out docs"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--out", type=Path, default=Path("docs"), metavar="DIR", help="default docs"
    )


def run(options: argparse.Namespace) -> int:
    """Run every command of the page; 1 where one fails."""
    from gait_entrainment.commands import main

    figures = options.out / "results"
    figures.mkdir(parents=True, exist_ok=True)
    page = [_HEADING]
    for number, section in enumerate(SECTIONS, start=1):
        print(f"entrain {' '.join(section.arguments)}", file=sys.stderr)
        with tempfile.TemporaryDirectory() as folder:
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                status = main([*section.arguments, "--out", folder])
            if status != 0:
                print(f"entrain results: entrain {section.arguments[0]} failed", file=sys.stderr)
                return 1
            page.append(_part(section, output.getvalue()))
            for name in section.figures:
                drawn = f"{number:02d}_{name}.png"
                shutil.copyfile(Path(folder) / f"{name}.png", figures / drawn)
                page.append(f"![{section.title}: {name.replace('_', ' ')}](results/{drawn})\n")
    (options.out / "results.md").write_text("\n".join(page), encoding="utf-8")
    print(f"written          {options.out / 'results.md'}")
    return 0


def _part(section: Section, output: str) -> str:
    """Title, text, command and output; tables stay tables, the rest is a block."""
    lines = [
        line for line in output.splitlines() if not line.startswith(("figure  ", "written  "))
    ]
    command = " ".join(("entrain", *section.arguments))
    text = "\n".join(lines).strip()
    body = text if "| --- |" in text else f"```text\n{text}\n```"
    prose = textwrap.fill(section.text, 99)
    return f"## {section.title}\n\n{prose}\n\n    {command}\n\n{body}\n"
