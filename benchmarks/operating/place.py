"""Where a day takes place: a folder that `rig init` made, its simulated bench, and the log that says what the motor
really did."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.operating.at_keys import DayError, Transcript
from sim_devices.wires.ports import ask

SAME = 0.01
"""V"""
AT_REST = 0.5
"""rev/s, as the bench file's `rest_rate`."""


@dataclass
class Place:
    """The bench as the world has it: what an operator can't see, and what his hands do to cables."""

    folder: Path
    transcript: Transcript

    @property
    def campaign(self) -> Path:
        """The newest campaign's folder, as typed from the bench's."""
        newest = max((self.folder / "recordings").iterdir(), key=lambda path: path.stat().st_mtime)
        return newest.relative_to(self.folder)

    def tell(self, *words: str) -> None:
        """A cable, or a fault: `fault load_cell pulled`, `clear load_cell`."""
        answer = ask(self.folder / "ports" / "control", " ".join(words))
        if not answer.startswith("ok "):
            raise DayError(f"the bench refuses {' '.join(words)}: {answer}")
        self.transcript.write(f"\n{self.transcript.clock()} the bench: {' '.join(words)}: {answer}")

    def states(self, seconds: float) -> list[dict[str, Any]]:
        """What the motor did in the last `seconds`: `command` (V or None), `n` (rev/s), `t_ns`."""
        path = self.folder / "ports" / "truth.jsonl"
        with path.open("rb") as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(end - round(seconds * 100 + 50) * 300, 0))  # 100 lines/s of less than 300 bytes
            lines = file.read().split(b"\n")[1:-1]
        since = time.monotonic_ns() - round(seconds * 1e9)
        read = (json.loads(line) for line in lines)
        return [state for state in read if state["event"] == "state" and state["t_ns"] >= since]

    def events(self, since_ns: int) -> list[dict[str, Any]]:
        """Commands and lapses since an instant of this machine's monotonic clock."""
        with (self.folder / "ports" / "truth.jsonl").open(encoding="utf-8") as file:
            read = (json.loads(line) for line in file.read().split("\n")[:-1])
            return [line for line in read if line["event"] in ("command", "timeout") and line["t_ns"] >= since_ns]

    def driven(self, since_ns: int) -> bool:
        """Whether any command but 0 was obeyed since."""
        return any(line.get("value") for line in self.events(since_ns))

    def until_still(self, within: float = 8.0) -> None:
        """Command 0 (or let go) and the rotor at rest for half a second."""

        def still(states: list[dict[str, Any]]) -> bool:
            return all(not state["command"] and abs(state["n"]) < AT_REST for state in states)

        self._until("0 V, and the rotor at rest", still, 0.5, within)

    def until_driven(self, within: float = 60.0) -> None:
        """The same command but 0 for half a second, and the rotor turns."""

        def held(states: list[dict[str, Any]]) -> bool:
            commands = [state["command"] or 0.0 for state in states]
            return max(commands) - min(commands) < SAME and abs(commands[-1]) > SAME and abs(states[-1]["n"]) > AT_REST

        self._until("one command is held, and the rotor turns", held, 0.5, within)

    def zero_after(self, since_ns: int, within: float) -> None:
        """Command 0 within `within` s of an instant, and not driven again since."""
        self.until_still()
        found = [line for line in self.events(since_ns) if line["event"] == "timeout" or not line["value"]]
        if not found:
            raise DayError("no command 0 in the truth log")
        took = (found[0]["t_ns"] - since_ns) * 1e-9
        if took > within or self.driven(found[0]["t_ns"]):
            raise DayError(f"command 0 came {took:.3f} s later, {within:g} s are allowed, or it was driven again")
        self.transcript.fact(f"by the truth log: command 0 V {1000 * took:.0f} ms after that, and not driven again")

    def _until(self, what: str, true: Callable[[list[dict[str, Any]]], bool], seconds: float, within: float) -> None:
        deadline = time.monotonic() + within
        while not ((states := self.states(seconds)) and true(states)):
            if time.monotonic() > deadline:
                raise DayError(f"not within {within:g} s by the truth log: {what}; it was {states[-1:]}")
            time.sleep(0.1)
        self.transcript.fact(f"by the truth log: {what}")
