"""The control port of a simulated bench: one command a line, one answer a line, `ok ...` or `error ...`.

mount THRUSTER                  put another thruster on the bench; refused while the rotor turns
fault TARGET FAULT [AMOUNT]     a device or an adapter goes wrong from now on
clear TARGET                    it is in order again; a pulled cable is back
flow SPEED                      tunnel flow, m/s
hang FORCE                      dead weights of so many N on the stand, positive forward; refused while the rotor turns
status                          JSON: thruster, rotation rate, thrust, messages lost
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Protocol

from sim_devices.bench.settings import BenchSettings
from sim_devices.instruments.can_node import CanNode
from sim_devices.instruments.serial_device import SerialDevice
from sim_devices.tables import WorldError, check_known
from sim_devices.wires.ports import PtyPort
from sim_devices.wires.serial_line import DEFAULT_AMOUNT, WIRE_FAULTS
from sim_devices.wires.slcan import Adapter
from sim_devices.world import World
from sim_devices.world.world import REST_RATE


class ControlledBench(Protocol):
    """What a command of the control port reaches of a bench, which makes and closes all of it."""

    @property
    def settings(self) -> BenchSettings: ...

    @property
    def world(self) -> World: ...

    @property
    def serial(self) -> Mapping[str, tuple[SerialDevice, PtyPort, float]]:
        """Device name -> device, its port, its turnaround (s)."""

    @property
    def adapters(self) -> Mapping[str, tuple[Adapter, PtyPort]]: ...

    @property
    def nodes(self) -> Mapping[str, CanNode]:
        """Devices on the CAN bus."""

    @property
    def ports(self) -> Sequence[PtyPort]: ...

    def now(self) -> float:
        """Time since the bench was started, s."""

    def log(self, event: str, **fields: object) -> None:
        """One line of the truth log, stamped now."""


def obey(bench: ControlledBench, line: str) -> str:
    """Do what one line says; the answer says what was done, or why not."""
    try:
        return f"ok {_done(bench, line.split())}"
    except (ValueError, WorldError) as error:
        return f"error {error}"


def _done(bench: ControlledBench, words: list[str]) -> str:
    match words:
        case ["mount", thruster]:
            mount(bench, thruster)
            return f"{thruster} is on the bench"
        case ["fault", target, name, *rest] if len(rest) <= 1:
            fault(bench, target, name, float(rest[0]) if rest else DEFAULT_AMOUNT)
            return f"{target} has fault {name}"
        case ["clear", target]:
            clear(bench, target)
            return f"{target} is in order"
        case ["flow", speed]:
            set_flow(bench, float(speed))
            return f"flow is {float(speed)} m/s"
        case ["hang", force]:
            hang(bench, float(force))
            return f"{float(force)} N hang on the stand"
        case ["status"]:
            return json.dumps(status(bench))
        case _:
            raise ValueError(
                "control: expected mount THRUSTER, fault TARGET FAULT [AMOUNT], clear TARGET, flow SPEED, hang FORCE "
                f"or status, got {' '.join(words)!r}"
            )


def mount(bench: ControlledBench, thruster: str) -> None:
    """Put another thruster on. Raises ValueError while the rotor turns, WorldError for an unknown name."""
    bench.world.mount(thruster)
    bench.log("mount")


def fault(bench: ControlledBench, target: str, name: str, amount: float = DEFAULT_AMOUNT) -> None:
    """A device, or the wire of a device or adapter, goes wrong from now on. Raises ValueError or WorldError.

    `pulled` takes the cable out. `amount` is a share (0..1), for `delayed` seconds; of a lie see its device.
    """
    port, device = _target(bench, target)
    if port is not None and name == "pulled":
        port.pull()
    elif port is not None and name in WIRE_FAULTS:
        port.wire.fault(name, amount)
    elif device is not None and name in device.faults:
        device.fault(name, bench.now(), amount)
    else:
        known = (*(device.faults if device else ()), *(("pulled", *WIRE_FAULTS) if port else ()))
        raise ValueError(f"{target}: expected one of {', '.join(known)}, got {name!r}")
    bench.log("fault", target=target, fault=name, amount=amount)


def clear(bench: ControlledBench, target: str) -> None:
    """The target is in order again; a pulled cable is back, on a new pty under the same name."""
    port, device = _target(bench, target)
    if port is not None:
        port.plug()
        port.wire.clear()
    if device is not None:
        device.clear(bench.now())
    bench.log("clear", target=target)


def set_flow(bench: ControlledBench, speed: float) -> None:
    """Tunnel flow from now on, m/s."""
    bench.world.state.flow = speed
    bench.log("flow", speed=speed)


def hang(bench: ControlledBench, force: float) -> None:
    """Dead weights on the stand from now on, N. Raises ValueError while the rotor turns, or for no number."""
    s = bench.world.state
    if not isfinite(force):
        raise ValueError(f"hang: expected a finite force in N, got {force}")
    if abs(s.n) > REST_RATE:
        raise ValueError(f"hang: the rotor turns at {s.n:.1f} rev/s; stop the motor before a hand comes near")
    s.hung = force
    bench.log("hang", force=force)


def status(bench: ControlledBench) -> dict[str, object]:
    """Thruster on the bench, rotation in rev/s, thrust in N, flow in m/s, messages lost per port."""
    s = bench.world.state
    return {
        "thruster": bench.world.mounted,
        "rotation_rate": s.n,
        "thrust": s.thrust,
        "flow_speed": s.flow,
        "lost": {port.link.name: port.wire.lost for port in bench.ports},
    }


def _target(bench: ControlledBench, name: str) -> tuple[PtyPort | None, SerialDevice | CanNode | None]:
    check_known(name, [*bench.settings.devices, *bench.adapters], "target")
    if name in bench.adapters:
        return bench.adapters[name][1], None
    if name in bench.serial:
        device, port, _ = bench.serial[name]
        return port, device
    return None, bench.nodes[name]
