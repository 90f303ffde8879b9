"""Benches of several makes, drawn: the devices of the simulated side, and the bench file that tells the rig of them.

What the file states (delay, window, filter) is what the maker would; the device's own delay is off by what the file
says that it may be, and its clock by some parts in a hundred thousand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sim_devices.bench.settings import DeviceOptions
from sim_devices.bench.virtual_wire import Host
from sim_devices.concealed.cases.definition import Amplifier
from sim_devices.instruments.serial_lines.line_sender import WIDTH, LineOptions
from sim_devices.instruments.serial_lines.mt_sics_options import MtSicsOptions
from sim_devices.instruments.serial_lines.nortek import NortekOptions
from sim_devices.instruments.vesc.controller import VescOptions

Rng = np.random.Generator

BUS, CELL, MOTOR, FLOW = "bus0", "load_cell", "motor", "flow"
ADAPTER_STD = 0.0005
"""s: what the drivers state of the least delay of an adapter and the computer (drivers' HOST_DELAY_STD)."""
APART = 2e-4
"""s between the conversions that stand for a mean over a time, about: what 0.8 ms leave between them shows in a run."""
CLOCK_STD = 3e-5
"""relative: quartz at room temperature, 30 ppm; the drivers state 100."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A load cell with its electronics, on both sides."""

    options: MtSicsOptions | LineOptions
    filter_time: float
    """s of its low pass; 0: none."""
    quantum: float
    """N."""
    told: str
    """Its table of the bench file."""

    @property
    def rate(self) -> float:
        """Readings per second, by its own clock."""
        return self.options.rate

    @property
    def average(self) -> int:
        return self.options.average

    @property
    def amplifier(self) -> Amplifier:
        """The same for an oracle, to which a mean of pieces is one over time."""
        return Amplifier(self.filter_time, 1.0 / self.rate if self.average > 1 else 0.0)


@dataclass(frozen=True, slots=True)
class Bench:
    """A bench as it was drawn: its cell, its devices and how fast its loop runs."""

    name: str
    cell: Cell
    devices: dict[str, DeviceOptions]
    host: Host
    loop_rate: float
    """1/s"""
    motor: str
    """Table of the bench file."""
    flow: str
    """The same; empty: no flow meter."""


def bench(name: str, thrust: float, bus: float, rng: Rng) -> Bench:
    """The bench `name` of BENCHES, for a thruster of at most `thrust` N on a supply of `bus` V.

    Raises ValueError for another name.
    """
    if name not in BENCHES:
        raise ValueError(f"bench must be one of {', '.join(BENCHES)}, got {name!r}")
    cell = BENCHES[name](thrust, rng)
    telemetry = 50.0 if name == "tunnel" else float(rng.choice((20.0, 50.0, 100.0)))
    off = 1.0 + _clock(rng)
    vesc = VescOptions(
        "vesc", timeout=0.5, rate_1=telemetry * off, messages_1=("STATUS", "STATUS_5"), rate_2=5.0 * off,
        messages_2=("STATUS_4",),
    )  # fmt: skip
    devices: dict[str, DeviceOptions] = {CELL: cell.options, MOTOR: vesc}
    if name == "tunnel":
        devices[FLOW] = NortekOptions("nortek", "flow", rate=4.0)
    told = {"kind": "vesc_can", "bus": BUS, "vesc_id": 23, "pole_pairs": 7, "nominal_bus_voltage": bus}
    told |= {"watchdog_timeout": 0.5, "rate": telemetry, "supply_rate": telemetry, "thermal_rate": 5.0}
    flow = {"kind": "nortek_nmea", "port": "flow", "baud": 9600, "rate": 4.0}
    rates = (50.0,) if name == "tunnel" else (25.0, 50.0, 100.0)
    return Bench(
        name, cell, devices, host(rng), float(rng.choice(rates)), toml(told), toml(flow) if FLOW in devices else ""
    )


def host(rng: Rng) -> Host:
    """A computer: real-time scheduling on some, a desktop beside it on others."""
    return Host(
        adapter=float(abs(rng.normal(0.0, ADAPTER_STD))),
        work=_log(rng, 2e-4, 1.5e-3),
        reader_late=_log(rng, 5e-5, 5e-4),
        loop_late=_log(rng, 5e-5, 8e-4),
        stall_every=_log(rng, 5.0, 100.0),
        stall=_log(rng, 0.002, 0.03),
    )


def _tunnel(thrust: float, rng: Rng) -> Cell:
    """The weigh module of the demo: instant conversions, 92 a second."""
    digit = 0.001 if thrust > 30.0 else 0.0001
    options = MtSicsOptions("mt_sics", CELL, 38400, capacity=20.0 * thrust, digit=digit, clock_error=_clock(rng))
    told = {"kind": "mt_sics", "port": CELL, "baud": 38400, "rate": 92.0, "resolution": digit}
    return Cell(options, 0.0, digit, toml(told))


def _amplifier(thrust: float, rng: Rng) -> Cell:
    """Counts of a 24-bit converter at 80-odd lines a second, the mean of what it converted since the last line."""
    rate, count = float(rng.uniform(76.0, 92.0)), thrust * _log(rng, 1e-5, 1e-3)
    average = int(rng.choice((1, _pieces(rate))))
    low_pass = 0.0 if rng.random() < 0.5 else _log(rng, 0.001, 0.01)
    options = LineOptions("line", CELL, 115200, rate, count, average, _clock(rng))
    told = {"kind": "line_stream", "port": CELL, "baud": 115200, "rate": rate, "line_characters": WIDTH + 2}
    told |= {"pattern": "(?P<raw>-?\\d+)", "scale": count} | _acquired(rate, average, low_pass)
    return Cell(options, low_pass, count, toml(told))


def _balance(thrust: float, rng: Rng) -> Cell:
    """A weigh module that means over the whole time between two readings, 20 a second, behind a slow line."""
    digit = 0.01 if thrust > 30.0 else 0.001
    average, low_pass = _pieces(20.0), 0.0 if rng.random() < 0.5 else _log(rng, 0.003, 0.03)
    options = MtSicsOptions(
        "mt_sics", CELL, 9600, capacity=20.0 * thrust, digit=digit, rate=20.0, max_rate=20.0, average=average,
        clock_error=_clock(rng),
    )  # fmt: skip
    told = {"kind": "mt_sics", "port": CELL, "baud": 9600, "rate": 20.0, "resolution": digit}
    return Cell(options, low_pass, digit, toml(told | _acquired(20.0, average, low_pass)))


BENCHES: dict[str, Callable[[float, Rng], Cell]] = {"tunnel": _tunnel, "amplifier": _amplifier, "balance": _balance}
"""tunnel: that of the demo."""


def _pieces(rate: float) -> int:
    """Conversions of one reading."""
    return round(1.0 / (rate * APART))


def _acquired(rate: float, average: int, low_pass: float) -> dict[str, float | str]:
    """What the bench file says of a converter: its window, its filter's group delay at low frequencies."""
    told: dict[str, float | str] = {"window": 1.0 / rate} if average > 1 else {}
    if low_pass:
        told |= {"delay": low_pass, "low_pass": low_pass}
        told |= {"filter": f"low pass, first order, {1.0 / (2.0 * np.pi * low_pass):.3g} Hz"}
    return told


def toml(table: Mapping[str, object]) -> str:
    """Lines `key = value`."""
    return "".join(f"{k} = {_said(v)}\n" for k, v in table.items())


def _said(value: object) -> str:
    return "'" + value + "'" if isinstance(value, str) else repr(value)


def _clock(rng: Rng) -> float:
    return float(rng.normal(0.0, CLOCK_STD))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
