# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain phase-response: what a single pulse does, and the lock that it predicts."""

import argparse
import json
import sys
from pathlib import Path

from gait_entrainment_studies.commands.pulse_options import (
    add_pulse_options,
    add_walker_options,
    check_at_least,
    check_period_offset,
    chosen_torque,
    chosen_walker,
)

DESCRIPTION = (
    "Advance of the heel strikes by one pulse, at every phase; and the locked phase where the "
    "advance is the unperturbed minus the pulse period, beside the exact one."
)
EXAMPLES = """examples:
  entrain phase-response                          predicted and exact lock at -50 ms
  entrain phase-response --out figures            also phase_response.csv and the curve
  entrain phase-response --period-offset -0.07 --period-offset -0.02
"""

_COLUMNS = ("phase", "onset", "lag", "shift", "first_stride_shift")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--period-offset",
        type=float,
        action="append",
        metavar="FLOAT",
        help="predict the lock at this pulse period off the stride period [s], may be given"
        " again; default -0.05",
    )
    parser.add_argument(
        "--points", type=int, default=201, metavar="INT", help="per branch; default 201"
    )
    add_pulse_options(parser)
    add_walker_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="write curve and CSV to a folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Solve and print; the curve itself goes to JSON and CSV."""
    import numpy as np

    from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
    from gait_entrainment_studies.phase_response.response import phase_response, predictions

    offsets = np.array(options.period_offset or [-0.05])
    try:
        walker = chosen_walker(options)
        pulse = walker, chosen_torque(options, walker), options.width
        for offset in offsets:
            check_period_offset(offset, PulsedGait(*pulse))
        check_at_least("points", options.points, 2)
        response = phase_response(*pulse, options.points)
        found = predictions(*pulse, offsets)
    except ValueError as error:
        print(f"entrain phase-response: {error}", file=sys.stderr)
        return 2
    curve = np.column_stack([getattr(response, name) for name in _COLUMNS])
    if options.json:
        rows = [[None if np.isnan(x) else x for x in row] for row in curve.tolist()]
        locks = [
            {
                "period_offset": one.period_offset,
                "predicted_lag": one.predicted.lag,
                "exact_lag": one.exact.lag,
                "predicted_stable": one.predicted.stable,
            }
            for one in found
        ]
        print(json.dumps({"columns": _COLUMNS, "curve": rows, "locks": locks}))
    else:
        most, least = np.nanmax(response.shift), np.nanmin(response.shift)
        print(f"stride period    {response.stride_period:.9f} s")
        print(f"advance          {least * 1e3:.4f} to {most * 1e3:.4f} ms in the end")
        ended = response.phase[np.isnan(response.shift)]
        if ended.size:
            print(
                f"falls, flies off at {ended.size} of {response.phase.size} phases, between"
                f" {np.nanmin(ended):.4f} and {np.nanmax(ended):.4f}"
            )
        for one in found:
            print(
                f"lock at {one.period_offset * 1e3:+.3f} ms: lag predicted"
                f" {one.predicted.lag * 1e3:.4f} ms, exact {one.exact.lag * 1e3:.4f} ms,"
                f" difference {one.lag_error * 1e3:+.4f} ms"
            )
        if not found:
            print("no stable lock at the chosen pulse periods")
    if options.out is not None:
        from gait_entrainment_studies.phase_response.figures import draw_response

        paths = draw_response(response, found, options.out)
        paths.append(options.out / "phase_response.csv")
        header = "phase [1],onset [s],lag [s],shift [s],first_stride_shift [s]"
        np.savetxt(paths[-1], curve, "%.12g", ",", header=header, comments="")
        for path in paths if not options.json else ():
            print(f"written          {path}")
    return 0
