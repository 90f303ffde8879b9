"""Renderables: readings, checks, and the result per thruster. Pure: a view in, rich out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Final

from rich.table import Table
from rich.text import Text

from rig.console.view_model import wording
from rig.console.view_model.running_fit import decimals, running_fit
from rig.console.view_model.view import View
from rig.link.front_end_messages import Check, Point, Reading, Snapshot, State

STATE_STYLES: Final = {
    "ok": "#7fd88f",
    "sent": "#7fd88f",
    "STALE": "bold #1b1b1b on #f0c040",
    "LIMIT": "bold #ffffff on #c02030",
    "no data": "#f0c040",
    "OLD": "#9a9a9a",
}
CHECK_WORDS: Final = {
    "passed": ("✓ passed", "#7fd88f"),
    "warning": ("! WARNING", "bold #f0c040"),
    "failed": ("✗ FAILED", "bold #ff6070"),
    "waiting": ("… waiting", "#9a9a9a"),
}
REFUSED: Final = "not started: "
"""Begins the event of a start that the controller has refused."""
TROUBLE_FIRST: Final = ("failed", "waiting", "warning", "passed")
NAME, VALUE, UNIT, LIMIT, AGE, STATE = 17, 9, 5, 11, 7, 7
"""Cells per column of the readings."""


def readings_text(view: View) -> Text:
    """One line per channel: value, unit, limit, age, state in a word."""
    text = Text(no_wrap=True)
    text.append(_columns("channel", "value", "unit", "limit", "age") + "state\n", "bold")
    snapshot = view.snapshot
    if snapshot is None:
        return text.append("nothing came yet")
    live = view.condition == "live"
    value = wording.number(snapshot.command, "V")
    _line(text, _columns("command", value, "V", "", wording.age(view.silence)), "sent" if live else "OLD", live)
    names = short_names(snapshot)
    for reading in snapshot.readings:
        age = None if reading.age is None else reading.age + view.silence
        columns = _columns(
            names[reading.channel],
            wording.number(reading.value, reading.unit),
            wording.unit(reading.unit),
            wording.limits(reading),
            wording.age(age),
        )
        _line(text, columns, wording.verdict(reading, live), live)
    text.right_crop(1)  # the last line's end would be a line of its own, and scroll
    return text


def _columns(name: str, value: str, unit: str, limit: str, age: str) -> str:
    return f"{name:<{NAME}.{NAME}} {value:>{VALUE}} {unit:<{UNIT}} {limit:>{LIMIT}} {age:>{AGE}}  "


def _line(text: Text, columns: str, word: str, live: bool) -> None:
    text.append(columns, "" if live else "#9a9a9a")
    text.append(f"{word:<{STATE}}", STATE_STYLES[word])
    text.append("\n")


def short_names(snapshot: Snapshot) -> dict[str, str]:
    """Channel -> its last part, or the whole where two share the last part."""
    tails = Counter(_tail(reading) for reading in snapshot.readings)
    return {r.channel: _tail(r) if tails[_tail(r)] == 1 else r.channel for r in snapshot.readings}


def _tail(reading: Reading) -> str:
    return reading.channel.rpartition(".")[2]


def checks_table(checks: tuple[Check, ...]) -> Table:
    """The preflight list, trouble first: it may be longer than the screen."""
    table = Table.grid(padding=(0, 2))
    table.add_column(width=10)
    table.add_column(no_wrap=True)
    table.add_column(ratio=1)
    for check in sorted(checks, key=lambda check: TROUBLE_FIRST.index(check.verdict)):
        word, style = CHECK_WORDS[check.verdict]
        table.add_row(Text(word, style), Text(check.name, "bold"), Text(check.text))
    return table


def results_table(points: Mapping[str, tuple[Point, ...]]) -> Table:
    """One row per thruster seen by this console: the fit over its holds. `scatter` is the standard deviation of C that
    follows from the points alone; `rig fit` adds the calibration's. `out`: holds that the fit leaves out."""
    table = Table(box=None, padding=(0, 1), header_style="bold")
    table.add_column("thruster", no_wrap=True)
    for heading in ("C [N/V²]", "scatter", "[%]", "rest [N]", "chi²/dof", "holds", "unsteady", "out"):
        table.add_column(heading, justify="right", no_wrap=True)
    for thruster, held in points.items():
        table.add_row(Text(thruster or "?"), *_result(held))
    return table


def misfits(points: Mapping[str, tuple[Point, ...]]) -> list[Text]:
    """A line for each thruster whose constant says too little, with what to do next."""
    found = [(thruster, fit) for thruster, held in points.items() if (fit := running_fit(held)) is not None]
    return [
        Text(f"{thruster}: C V|V| does NOT fit (chi²/dof {fit.misfit:.3g}). Next: g, or rig diagnose.", "bold #f0c040")
        for thruster, fit in found
        if fit.misfit is not None
    ]


def _result(held: tuple[Point, ...]) -> tuple[str, ...]:
    unsteady = str(sum(not point.steady for point in held))
    fit = running_fit(held)
    if fit is None:
        return ("—", "—", "—", "—", "—", str(len(held)), unsteady, "—")
    digits, known = decimals(fit.C_std), math.isfinite(fit.C_std)  # two points leave nothing to scatter
    percent = f"{100.0 * fit.C_std / abs(fit.C):.2f}" if fit.C and known else "—"
    C, std = f"{fit.C:.{digits}f}", f"{fit.C_std:.{digits}f}" if known else "—"
    judged = "—" if fit.per_dof is None else f"{fit.per_dof:.2g}" if fit.per_dof < 100 else f"{fit.per_dof:.0f}"
    return (C, std, percent, f"{fit.tare:+.2f}", judged, str(len(held)), unsteady, str(fit.left_out))


def refusal(snapshot: Snapshot | None) -> str:
    """The event with which the newest start was refused, while it still would be; empty: none was."""
    if snapshot is None or snapshot.state != "preflight":
        return ""
    if not any(check.verdict in ("failed", "waiting") for check in snapshot.checks):
        return ""
    refused = [line for line in snapshot.log if line.text.startswith(REFUSED)]
    return f"{refused[-1].time:.1f} s: {refused[-1].text}" if refused else ""


def verdict_summary(checks: tuple[Check, ...], state: State) -> Text:
    """The preflight in one sentence, and the key that follows from it."""
    if state == "connecting":
        return Text("The devices are opened, then watched for a moment: the checks of what they send follow.", "bold")
    count = Counter(check.verdict for check in checks)
    if count["failed"]:
        return Text(
            f"{count['failed']} of {len(checks)} checks FAILED: the controller will refuse to start.", "bold #ff6070"
        )
    if count["waiting"] or not checks:
        return Text(f"{count['waiting']} of {len(checks)} checks still run.", "bold")
    warned = f", {count['warning']} with a WARNING" if count["warning"] else ""
    return Text(f"All {len(checks)} checks done{warned}. Press F5 to start: the motor will turn.", "bold #7fd88f")
