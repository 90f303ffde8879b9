"""What became of a cell of the kill matrix once its signal was sent: who ends, when the motor rests, what files say."""

from __future__ import annotations

import json
import os
import random
import select
import signal
import time
from pathlib import Path
from typing import Any

from rig.errors import RecordingError, RigError
from rig.hdf5 import load, recover
from rig.link.front_end_messages import Request
from rig.link.sockets import connect
from tests.reliability.kills.kill_cells import (
    ALLOWED,
    PATIENCE,
    PHASES,
    PROCESSES,
    SIGNALS,
    SLACK,
    Cell,
    Live,
    campaign,
    reach,
    strike,
)
from tests.reliability.live import TICK, WATCHDOG
from tests.reliability.machine.metronome import stalled

REST = 0.5
"""rev/s"""
COAST = 3.0
"""s that the propeller may turn on after the motor was let go."""


def try_cell(folder: Path, process: str, name: str, phase: str, seed: int, metronome: Path) -> Cell:
    """Raises NotBegun when the phase never came."""
    with campaign(folder, console=process == "console") as live:
        reach(live, phase, random.Random(f"{seed} {process} {name} {phase}"))
        at = strike(live, process, name)
        if phase == "pause" and (process, name) != ("controller", "KILL"):
            _resume(live)
        hang = await_end(live, process, name)
        gone = process == "device" and name != "STOPCONT"
        truth = [] if gone else rested(live, at)
        facts = [fact for fact in live.facts() if fact["fact"] in ("run_end", "end")]
    return judge((process, name, phase), facts, truth, at, _files(folder), hang, metronome)


def _resume(live: Live) -> None:
    """An operator goes on after a pause, where somebody still hears him."""
    try:
        peer = connect(Path(live.run.socket), "the controller")
    except RigError:
        return
    peer.send(Request("resume"))
    select.select([], [], [], 0.2)
    peer.close()


def await_end(live: Live, process: str, name: str) -> str:
    """Names of the processes that did not end by themselves. One that stays stopped is killed when the others had their
    time: of a controller, recorder and front end wait for its last word.
    """
    if name == "STOP" and process in ("controller", "device"):
        select.select([], [], [], WATCHDOG + COAST + 1.0)
        _kill(live, process)
    hang = [] if process == "controller" and name == "STOP" else _lasting(live, ["controller"], PATIENCE)
    if name == "STOP":
        _kill(live, process)
    hang += _lasting(live, ["recorder", "watcher", live.front_name], PATIENCE / 2)
    return ", ".join(hang)


def _lasting(live: Live, names: list[str], patience: float) -> list[str]:
    end = time.monotonic() + patience
    while (there := [name for name in names if live.alive(name)]) and time.monotonic() < end:
        if live.terminal is not None and there == ["console"]:
            live.terminal.press(b"\rd")  # it shows the end until somebody leaves
        select.select([], [], [], 0.1)
    return there


def _kill(live: Live, process: str) -> None:
    if live.alive(process):
        os.kill(live.front.pid if process == live.front_name else live.pids[process][0], signal.SIGKILL)


def rested(live: Live, at: int) -> list[dict[str, Any]]:
    """The truth, once the propeller is at rest or had its time."""
    end = at * 1e-9 + WATCHDOG + COAST
    while True:
        truth = live.bench.truth()
        newest = [line for line in truth if line["event"] == "state"][-1]
        if abs(newest["n"]) < REST or time.monotonic() > end:
            return truth
        select.select([], [], [], 0.1)


def _files(folder: Path) -> str:
    """Each recording is read, and recovered where it was not closed."""
    said = []
    for path in sorted((folder / "out").glob("*/*.h5")):
        try:
            recording = load(path)
            if not recording.complete:
                recover(path, path.with_name(f"{path.stem}-recovered.h5"))
                load(path.with_name(f"{path.stem}-recovered.h5"))
            rows = sum(channel.time.size for channel in recording.all_of("thrust"))
            said.append(f"{'closed' if recording.complete else 'open'} {rows}")
        except (RecordingError, OSError) as error:
            said.append(f"UNREADABLE: {error}")
    return ", ".join(said) or "none"


def judge(
    which: tuple[str, str, str],
    facts: list[dict[str, Any]],
    truth: list[dict[str, Any]],
    at: int,
    files: str,
    hang: str,
    metronome: Path,
) -> Cell:
    """`facts`: the ends of run and campaign. `truth`: of the bench. `at`: ns, of the signal. `metronome`: its file."""
    process, name, _ = which
    states = [line for line in truth if line["event"] == "state" and line["t_ns"] >= at]
    driven = max([(s["t_ns"] - at) * 1e-9 for s in states if abs(s["command"] or 0.0) > 0.01], default=0.0)
    at_rest = abs(states[-1]["n"]) < REST if states else True
    outcome, cause = (facts[-1]["outcome"], facts[-1]["cause"]) if facts else ("-", "")
    allowed = ALLOWED.get(process, {}).get(name, WATCHDOG + TICK) + SLACK
    held_up = stalled(metronome, at, at + round(driven * 1e9))
    faults = []
    if outcome != "completed" and driven - held_up > allowed:
        faults.append(f"driven for {driven:.2f} s, {allowed:.2f} s are allowed")
    if not at_rest:
        faults.append("the propeller turns at the end")
    if "UNREADABLE" in files:
        faults.append(files)
    if hang:
        faults.append(f"does not end: {hang}")
    return Cell(*which, outcome, round(driven, 3), at_rest, files, hang, cause, tuple(faults))


def told(cells: list[Cell]) -> str:
    """A table: process and signal down, phases across. `ok` went on to its end; a number: stopped, s of driving."""
    by = {(cell.process, cell.signal, cell.phase): cell for cell in cells}
    lines = ["process     signal   " + "".join(f"{phase:>9}" for phase in PHASES)]
    for process in PROCESSES:
        for name in SIGNALS:
            row = [by.get((process, name, phase)) for phase in PHASES]
            if any(row):
                lines.append(f"{process:<11} {name:<9}" + "".join(f"{_word(cell):>9}" for cell in row))
    bad = [cell for cell in cells if cell.faults]
    lines.append(f"{len(cells)} cells tried, {len(cells) - len(bad)} good")
    lines += [f"{cell.process}/{cell.signal}/{cell.phase}: {'; '.join(cell.faults)} [{cell.cause}]" for cell in bad]
    return "\n".join(lines)


def _word(cell: Cell | None) -> str:
    if cell is None:
        return "."
    mark = "!" if cell.faults else ""
    return mark + ("ok" if cell.outcome == "completed" else f"{cell.driven:.2f}")


def line(cell: Cell) -> str:
    return json.dumps({**cell.__dict__, "faults": list(cell.faults)})


def cell_of(text: str) -> Cell:
    facts = json.loads(text)
    return Cell(**{**facts, "faults": tuple(facts["faults"])})
