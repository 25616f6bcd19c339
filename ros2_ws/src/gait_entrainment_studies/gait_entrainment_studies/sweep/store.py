# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Results of a sweep on disk: one Parquet file per torque while it runs, one for all at the end.

A file appears whole or not at all, so an interrupted sweep goes on where it was when the same
command is given again; with another plan or other versions in the same folder it refuses.
"""

import json
import os
from pathlib import Path
from typing import Any

from gait_entrainment_studies.sweep.plan import SweepError, SweepPlan
from gait_entrainment_studies.sweep.row import Row

_METADATA = b"gait_entrainment_studies.sweep"


class SweepStore:
    """The folder of a sweep. Raises SweepError where it holds another sweep."""

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self.folder = folder
        self._plan = plan
        self._parts = folder / "parts"
        self._provenance = plan.provenance()
        self._parts.mkdir(parents=True, exist_ok=True)
        description = folder / "sweep.json"
        if description.exists() and any(self._parts.iterdir()):
            self._refuse_another(description)
        else:
            _write_whole(description, json.dumps(self._provenance, indent=1).encode())

    @property
    def table_path(self) -> Path:
        """The Parquet file of the whole sweep."""
        return self.folder / "tongue.parquet"

    def missing(self) -> list[int]:
        """Return the rows that are not on disk yet, or damaged there."""
        rows = range(self._plan.torque_fractions.count)
        return [index for index in rows if not _whole(self._part(index))]

    def add(self, index: int, row: Row) -> None:
        """Write one row."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        sink = pa.BufferOutputStream()
        pq.write_table(pa.table(row), sink)
        _write_whole(self._part(index), sink.getvalue().to_pybytes())

    def finish(self) -> Path:
        """Join all rows, one at a time, into one file that carries plan and versions."""
        import pyarrow.parquet as pq

        metadata = {_METADATA: json.dumps(self._provenance).encode()}
        schema = pq.read_schema(self._part(0)).with_metadata(metadata)
        unfinished = self.table_path.with_suffix(".unfinished")
        with pq.ParquetWriter(unfinished, schema) as writer:
            for index in range(self._plan.torque_fractions.count):
                writer.write_table(pq.read_table(self._part(index)).cast(schema))
        os.replace(unfinished, self.table_path)
        return self.table_path

    def _part(self, index: int) -> Path:
        return self._parts / f"{index:06d}.parquet"

    def _refuse_another(self, description: Path) -> None:
        try:
            stored = _flat(json.loads(description.read_bytes()))
        except ValueError:
            raise SweepError(f"{description} is damaged: choose another folder") from None
        wanted = _flat(self._provenance)
        for name in [*wanted, *stored]:
            if stored.get(name) != wanted.get(name):
                raise SweepError(
                    f"{self.folder} holds a sweep with {name} {stored.get(name)}, not"
                    f" {wanted.get(name)}: resume it with that, or choose another folder"
                )


def read_sweep(path: Path) -> tuple[Any, dict[str, Any]]:
    """Return the table of a finished sweep (pyarrow) and its plan with versions."""
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    return table, json.loads(table.schema.metadata[_METADATA])


def _flat(nested: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat = {}
    for name, value in nested.items():
        if isinstance(value, dict):
            flat.update(_flat(value, prefix + name + "."))
        else:
            flat[prefix + name] = value
    return flat


def _whole(part: Path) -> bool:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        pq.read_table(part)
    except (FileNotFoundError, pa.ArrowInvalid):
        return False
    return True


def _write_whole(path: Path, content: bytes) -> None:
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_bytes(content)
    os.replace(unfinished, path)
