"""Rows of a store as Parquet: `TABLE/day=YYYY-MM-DD/rows.parquet`, units in the metadata of each field."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from rig.errors import ConfigError
from rig.fleet.columns import Column
from rig.fleet.store import Store

HEADER = "thruster_rig"
"""Key of what the file is, as JSON, in its metadata."""
FORMAT = "thruster-rig-rows"
FORMAT_VERSION = 1


def require_pyarrow() -> None:
    """Raises ConfigError."""
    if find_spec("pyarrow") is None:
        raise ConfigError(
            "rows are written as Parquet, by pyarrow, which is not installed: pip install 'thruster-rig[parquet]'"
        )


def write_stale(store: Store, table: str, columns: Sequence[Column]) -> list[str]:
    """Write the days whose rows have changed, each whole or not at all; these days. Raises OSError."""
    days = store.stale_days(table)
    if days:
        import pyarrow as pa  # a second to import: only where something is written
        import pyarrow.parquet as pq

        schema = schema_of(table, columns)
        for day in days:
            folder = store.root / table / f"day={day}"
            folder.mkdir(parents=True, exist_ok=True)
            part = folder / ".rows.part"
            pq.write_table(pa.Table.from_pylist(store.rows_of(table, day), schema=schema), part)
            part.replace(folder / "rows.parquet")
            store.is_written(table, day)
    return days


def schema_of(table: str, columns: Sequence[Column]) -> Any:
    """The Arrow schema."""
    import pyarrow as pa

    about = {HEADER: json.dumps({"format": FORMAT, "version": FORMAT_VERSION, "table": table})}
    return pa.schema([_field(column) for column in columns], metadata=about)


def _field(column: Column) -> Any:
    import pyarrow as pa

    metadata = {"unit": column.unit} if column.unit else None
    return pa.field(column.name, _type(column), metadata=metadata)


def _type(column: Column) -> Any:
    import pyarrow as pa

    match column.kind:
        case "structures":
            return pa.list_(pa.struct([_field(part) for part in column.parts]))
        case "texts":
            return pa.list_(pa.string())
        case "number":
            return pa.float64()
        case "whole":
            return pa.int64()
        case "truth":
            return pa.bool_()
        case _:
            return pa.string()
