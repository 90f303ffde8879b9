"""Pairs of channels that were exchanged: each follows the law of the other.

A swap of two that follow the same law (thrust and current) cannot be known and is never claimed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identification.mismatch import policy
from identification.mismatch.faults.cells import BLOCKS, Cells, by_blocks, explained, fitted, gain, own, shapes
from identification.mismatch.faults.driver_laws import LINEAR, SQUARE
from identification.recording import Channel, Floats, Recording

SIGNLESS = ("bus_voltage", "flow_speed", "motor_temperature", "water_temperature")


def swaps(cells: Cells) -> list[tuple[str, str, str, float]]:
    """(quantity, quantity, statement, p) of pairs that were exchanged, the clearest first."""
    x = shapes(cells.driver)
    out = []
    for a in LINEAR:
        for b in SQUARE:
            if a in cells.values and b in cells.values:
                p = max(_rather(cells, a, x["quadratic"], x["linear"]), _rather(cells, b, x["linear"], x["quadratic"]))
                says = f"{b} goes as the {cells.driver_quantity} and {a} as its square: they are swapped."
                out.append((a, b, says, p))
    return sorted([*out, *_exchanged(cells), *_flow(cells)], key=lambda s: s[3])


def _rather(cells: Cells, quantity: str, law: Floats, other: Floats) -> float:
    """P-value that `law` does not describe the channel better than `other`; 1 unless it does so plainly."""
    y = cells.values[quantity]
    if np.count_nonzero(np.isfinite(y)) < BLOCKS or explained(law, y) < policy.faults.FOLLOWS_LAW:
        return 1.0
    _, left = fitted(law, y)
    _, left_other = fitted(other, y)
    if np.nansum(left**2) > policy.faults.OTHER_LAW_VARIANCE * np.nansum(left_other**2):
        return 1.0
    return by_blocks(cells, left_other**2 - left**2)[2]


def _exchanged(cells: Cells) -> Iterator[tuple[str, str, str, float]]:
    """A channel without a sign that follows the driver's sign, and one that should and does not."""
    if not cells.both_ways:
        return
    odd = shapes(cells.driver)["odd"]
    free = {q: explained(odd, cells.values[q]) for q in SIGNLESS if q in cells.values}
    bound = {
        q: explained(odd, cells.values[q])
        for q in (*LINEAR, *SQUARE)
        if q in cells.values and not _sizes(cells, cells.values[q])
    }
    for b, strong in free.items():
        for a, weak in bound.items():
            if strong > policy.faults.FOLLOWS_LAW and weak < policy.faults.STRANGE_TO_LAW:
                _, _, p = gain(cells, shapes(cells.driver)["quadratic"], cells.values[b], 1)
                says = f"{b} follows the sign of the {cells.driver_quantity} and {a} does not: they are swapped."
                yield a, b, says, p * (1 + max(weak, 0.0))


def _sizes(cells: Cells, y: Floats) -> bool:
    """Whether it looks like the size of something that follows the driver: even in it, from about zero."""
    if not np.isfinite(y).any() or explained(shapes(cells.driver)["even"], y) < policy.faults.EVEN_LAW:
        return False
    return bool(np.nanmin(np.abs(y)) < policy.faults.SIZE_AT_REST * (np.nanmax(y) - np.nanmin(y)))


def _flow(cells: Cells) -> Iterator[tuple[str, str, str, float]]:
    """A flow too fast for water, or that never falls below the largest command, beside a channel that could be one."""
    flow = cells.values.get("flow_speed")
    if flow is None or not np.isfinite(flow).any():
        return
    least = float(np.nanmin(np.abs(flow)))
    for b in ("bus_voltage", "motor_temperature", "water_temperature"):
        y = cells.values.get(b)
        if y is None or not np.isfinite(y).any():
            continue
        most = float(np.nanmax(np.abs(y)))
        no_bus = (
            b == "bus_voltage"
            and cells.driver_quantity != "rotation_rate"
            and most < policy.faults.BUS_BELOW_COMMAND * cells.size < least
        )
        if (least > policy.faults.FASTEST_FLOW and most < policy.faults.FASTEST_FLOW) or no_bus:
            says = f"A flow_speed of {np.nanmedian(flow):.3g} m/s is no flow, and {b} looks like one: they are swapped."
            yield "flow_speed", b, says, 0.0


def swapped_voltages(recording: Recording) -> list[tuple[str, str, str, float]]:
    """Command and motor voltage: a command rests at levels, a measurement comes steadily and hardly repeats a value."""
    command, motor = own(recording, "command_voltage"), own(recording, "motor_voltage")
    if command is None or motor is None or min(command.time.size, motor.time.size) < policy.faults.CHANNEL_CELLS:
        return []
    if not (_steady(command) and _rests(motor)):
        return []
    held = np.nan_to_num(motor.held_at(command.time))
    if np.std(held) <= 0 or np.corrcoef(held, np.nan_to_num(command.value))[0, 1] ** 2 < policy.faults.FOLLOWS_LAW:
        return []
    says = "motor_voltage rests at exact levels and command_voltage never rests: they are swapped."
    return [("command_voltage", "motor_voltage", says, 0.0)]


def _gaps(channel: Channel) -> Floats:
    """S between changes of its value."""
    moved = np.diff(channel.value, prepend=np.nan) != 0
    out: Floats = np.diff(channel.time[moved])
    return out


def _steady(channel: Channel) -> bool:
    gaps = _gaps(channel)
    return gaps.size > policy.faults.MEASURED_ROWS_MOVE * (channel.time.size - 1) > 3 * BLOCKS and float(
        np.max(gaps)
    ) < 5 * float(np.median(gaps))


def _rests(channel: Channel) -> bool:
    """Whether its value stays for very different times, or its rows repeat it."""
    gaps = _gaps(channel)
    few = gaps.size < 0.5 * channel.time.size
    return few or bool(gaps.size and np.std(gaps) > policy.faults.COMMAND_REST_SCATTER * np.mean(gaps))
