"""Wires: bytes to SI numbers and back. Knows no campaign, file or screen.

`KINDS` is the list of devices that a bench file can name. A new device is one file in the folder of its family and
one line here
(docs/howto/add-a-device.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from drivers.hbm.aed import HbmAed
from drivers.hbm.options import Options as HbmAedOptions
from drivers.modbus import keller
from drivers.modbus.cell import ModbusCell
from drivers.modbus.cell_options import Options as ModbusCellOptions
from drivers.protocols import Instrument
from drivers.roboteq.controller import Roboteq
from drivers.roboteq.options import Options as RoboteqOptions
from drivers.serial_lines import line_stream, mt_sics, nortek_nmea
from drivers.vesc import over_can


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of device: its options and how it is built. Building opens nothing."""

    options: type[Any]
    """Frozen dataclass; its `__post_init__` raises ValueError for impossible values."""
    build: Callable[..., Instrument]
    """`build(name, options)` or, over a wire that is given, `build(name, options, wire)` for a serial device;
    `build(name, options, bus)` for one on CAN."""
    link: Literal["serial", "can"]


KINDS: dict[str, Kind] = {
    "mt_sics": Kind(mt_sics.Options, mt_sics.MtSics, "serial"),
    "hbm_aed": Kind(HbmAedOptions, HbmAed, "serial"),
    "line_stream": Kind(line_stream.Options, line_stream.LineStream, "serial"),
    "modbus_cell": Kind(ModbusCellOptions, ModbusCell, "serial"),
    "nortek_nmea": Kind(nortek_nmea.Options, nortek_nmea.NortekNmea, "serial"),
    "keller": Kind(keller.Options, keller.Keller, "serial"),
    "roboteq": Kind(RoboteqOptions, Roboteq, "serial"),
    "vesc_can": Kind(over_can.Options, over_can.VescCan, "can"),
}
