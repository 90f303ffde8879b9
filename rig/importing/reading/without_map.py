"""A table that came without a map: what to type, and which shipped maps ask for nothing that it does not have."""

from __future__ import annotations

from rig.errors import RigError
from rig.importing.mapping import ImportMap, read_map, shipped
from rig.importing.reading.cells import columns_used, time_index
from rig.importing.reading.table import LINE_END, Refused, decode, read_table

HEAD = 65_536
"""Bytes that hold every header."""
SHOWN = 5


def what_to_do(data: bytes) -> str:
    """Of a text that is no JSON, as the end of a sentence."""
    fitting = fitting_maps(data)
    if fitting:
        return f"the columns are those of {' and '.join(fitting)}: --map {fitting[0]}"
    first = next((line.strip() for line in LINE_END.split(decode(data[:HEAD], "utf-8")[0]) if line.strip()), "")
    return (
        f"none that is shipped (rig import --list) fits {first[:60]!r}: say what its columns are in one "
        "of your own, --map MAP.toml, a few lines that `A map` of docs/howto/import-a-recording.md shows"
    )


def fitting_maps(data: bytes) -> list[str]:
    """Names of shipped maps of a table with a header, whose columns are all there."""
    plans = {name: read_map(name) for name in shipped()}
    return [name for name, plan in plans.items() if _named(plan) and _fits(data[:HEAD], plan)][:SHOWN]


def _named(plan: ImportMap) -> bool:
    return plan.file.kind == "text" and plan.file.header


def _fits(head: bytes, plan: ImportMap) -> bool:
    try:
        table = read_table(head, plan.file, Refused())
        columns_used(plan, table, plan.parameters)
        time_index(table, plan.time)
    except RigError:
        return False
    return len(table.rows) > 0
