# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Results of a sweep on disk: one Parquet file per torque while it runs, one for all at the end.

A file appears complete or not at all, so the same command resumes an interrupted sweep. A folder
that holds a sweep with another plan or other versions is refused.
"""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet

from gait_entrainment.errors import UsageError
from gait_entrainment_studies.sweep.plan import SweepPlan
from gait_entrainment_studies.sweep.row import Row

_METADATA = b"gait_entrainment_studies.sweep"


class SweepStore:
    """The folder of a sweep. Raises UsageError if it holds another sweep."""

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self.table_path = folder / "tongue.parquet"
        parts = folder / "parts"
        self._parts = [parts / f"{i:06d}.parquet" for i in range(plan.torque_fractions.count)]
        self._provenance = plan.provenance()
        parts.mkdir(parents=True, exist_ok=True)
        description = folder / "sweep.json"
        if description.exists() and any(parts.iterdir()):
            self._refuse_another(description)
        else:
            with _whole(description) as file:
                file.write_text(json.dumps(self._provenance, indent=1))

    def missing(self) -> list[int]:
        """Return the rows that are not yet on disk, or are damaged there."""
        return [index for index, part in enumerate(self._parts) if not _readable(part)]

    def add(self, index: int, row: Row) -> None:
        """Write one row."""
        with _whole(self._parts[index]) as file:
            pyarrow.parquet.write_table(pyarrow.table(row), file)

    def finish(self) -> Path:
        """Join all rows into one file that carries plan and versions; return its path."""
        table = pyarrow.concat_tables([pyarrow.parquet.read_table(part) for part in self._parts])
        metadata = {_METADATA: json.dumps(self._provenance).encode()}
        with _whole(self.table_path) as file:
            pyarrow.parquet.write_table(table.replace_schema_metadata(metadata), file)
        return self.table_path

    def _refuse_another(self, description: Path) -> None:
        try:
            stored = dict(_flat(json.loads(description.read_bytes())))
        except ValueError:
            raise UsageError(f"{description} is damaged: choose another folder") from None
        wanted = dict(_flat(self._provenance))
        for name in [*wanted, *stored]:
            if stored.get(name) != wanted.get(name):
                raise UsageError(
                    f"{description.parent} holds a sweep with {name} {stored.get(name)}, not"
                    f" {wanted.get(name)}: resume it with that value, or choose another folder"
                )


def read_sweep(path: Path) -> tuple[Any, dict[str, Any]]:
    """Return the table of a finished sweep (pyarrow) and its plan with versions."""
    table = pyarrow.parquet.read_table(path)
    return table, json.loads(table.schema.metadata[_METADATA])


def _flat(nested: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values by their dotted names."""
    for name, value in nested.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _readable(part: Path) -> bool:
    try:
        pyarrow.parquet.read_table(part)
    except (FileNotFoundError, pyarrow.ArrowInvalid):
        return False
    return True


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Yield a file to write, which then atomically takes its place under this name."""
    unfinished = path.with_suffix(".unfinished")
    yield unfinished
    os.replace(unfinished, path)
