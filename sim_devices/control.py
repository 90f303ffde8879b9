"""The control port of a simulated bench: one command a line, one answer a line, `ok ...` or `error ...`.

mount THRUSTER                  put another thruster on the bench; refused while the rotor turns
fault TARGET FAULT [AMOUNT]     a device or an adapter goes wrong from now on
clear TARGET                    it is in order again; a pulled cable is back
flow SPEED                      tunnel flow, m/s
status                          JSON: thruster, rotation rate, thrust, messages lost
"""

from __future__ import annotations

import json
from typing import Protocol

from sim_devices.tables import WorldError
from sim_devices.wire import DEFAULT_AMOUNT


class Operable(Protocol):
    """What the control port can do to a bench."""

    def mount(self, thruster: str, /) -> None: ...
    def fault(self, target: str, name: str, amount: float, /) -> None: ...
    def clear(self, target: str, /) -> None: ...
    def set_flow(self, speed: float, /) -> None: ...
    def status(self) -> dict[str, object]: ...


def obey(bench: Operable, line: str) -> str:
    """Do what one line says; the answer says what was done, or why not."""
    try:
        return f"ok {_done(bench, line.split())}"
    except (ValueError, WorldError) as error:
        return f"error {error}"


def _done(bench: Operable, words: list[str]) -> str:
    match words:
        case ["mount", thruster]:
            bench.mount(thruster)
            return f"{thruster} is on the bench"
        case ["fault", target, name, *rest] if len(rest) <= 1:
            bench.fault(target, name, float(rest[0]) if rest else DEFAULT_AMOUNT)
            return f"{target} has fault {name}"
        case ["clear", target]:
            bench.clear(target)
            return f"{target} is in order"
        case ["flow", speed]:
            bench.set_flow(float(speed))
            return f"flow is {float(speed)} m/s"
        case ["status"]:
            return json.dumps(bench.status())
        case _:
            raise ValueError(
                "control: expected mount THRUSTER, fault TARGET FAULT [AMOUNT], clear TARGET, flow SPEED or status, "
                f"got {' '.join(words)!r}"
            )
