"""Cases of sim_devices.concealed as recordings of identification: the only place where the two meet."""

from __future__ import annotations

from identification.recording import Channel, Recording, Step
from sim_devices.concealed import Case, Column, Rows, rows


def recordings(case: Case) -> list[Recording]:
    """Every run of the case."""
    return [_recording(found) for found in rows(case)]


def recording(case: Case) -> Recording:
    """The only run of the case. Raises ValueError when there are several."""
    (found,) = recordings(case)
    return found


def _recording(found: Rows) -> Recording:
    steps = tuple(Step(i, s.phase, s.volts, s.start, s.end) for i, s in enumerate(found.steps))
    channels = tuple(_channel(column) for column in found.columns)
    return Recording(found.recording_id, found.thruster, channels, steps, outcome="completed", source="simulated")


def _channel(column: Column) -> Channel:
    return Channel(
        name=column.name,
        stream=column.stream,
        quantity=column.quantity,
        unit=column.unit,
        time=column.time,
        value=column.value,
        thruster=column.thruster or None,
    )
