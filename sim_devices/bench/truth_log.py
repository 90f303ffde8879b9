"""The truth log: what the motor really did, one JSON object a line, flushed line by line.

Every line has `event`, `t_ns` (time.monotonic_ns of this machine, the clock of the rig) and `thruster`.
`header`: the true constants; `command_gain`: V at the motor for 1 V of command (an amplifier between them).
`command`: a set-point accepted by the drive that differs from the one before: `mode`, `value`, and `volts` where the
mode has any (a duty; 0 for every command of nothing, also of no current; null for currents and speeds).
`state`: command and applied volts, rotation rate (rev/s), current (A), thrust and force (N), at most at 100 Hz.
`timeout`: the drive let go by itself, `after` s without a command.
`fault`, `clear`, `mount`, `flow`: what the name says.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sim_devices.world import WorldSettings
from sim_devices.world.state import State


class TruthLog:
    """Path None: nothing is kept."""

    def __init__(self, path: Path | None) -> None:
        self._file = None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("w", encoding="utf-8", buffering=1)

    def write(self, event: str, t_ns: int, thruster: str, **fields: Any) -> None:
        if self._file is not None:
            line = {"event": event, "t_ns": t_ns, "thruster": thruster, **fields}
            self._file.write(json.dumps(line) + "\n")

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def header_fields(world: WorldSettings) -> dict[str, Any]:
    """The constants a campaign has to find. C in N/V^2, cell_gain relative, zero_offset in N."""
    return {
        "C": {name: each.C for name, each in world.thrusters.items()},
        "cell_gain": 1.0 + world.cell.gain_error,
        "zero_offset": world.cell.zero_offset,
        "effects": {name: dict(table) for name, table in world.effects.items()},
        "nominal_bus": world.supply.voltage,
    }


def state_fields(s: State) -> dict[str, Any]:
    """Volts commanded (None: released), volts the rotor answers to, rev/s, A, N, N."""
    return {
        "command": s.command if s.driven else None,
        "volts": round(s.volts, 6),
        "n": round(s.n, 6),
        "current": round(s.current, 4),
        "thrust": round(s.thrust, 6),
        "force": round(s.force, 6),
    }
