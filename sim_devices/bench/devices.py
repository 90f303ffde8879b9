"""The device side of each wire of a bench, made of its settings and the world that it measures."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

import numpy as np

from sim_devices.bench.settings import NodeOptions, SerialOptions
from sim_devices.instruments.button import Button, ButtonOptions
from sim_devices.instruments.can_node import CanNode
from sim_devices.instruments.can_signals import CanSender
from sim_devices.instruments.canopen.cell import Cell404, Cia404Options
from sim_devices.instruments.modbus.cell import ModbusCell
from sim_devices.instruments.modbus.keller import Keller, KellerOptions
from sim_devices.instruments.modbus.pzem import Pzem, PzemOptions
from sim_devices.instruments.modbus.registers import ModbusCellOptions
from sim_devices.instruments.modbus.registers_device import RegistersDevice, RegistersOptions
from sim_devices.instruments.serial_device import SerialDevice
from sim_devices.instruments.serial_lines.hbm_aed import HbmAed, HbmAedOptions
from sim_devices.instruments.serial_lines.line_sender import LineOptions, LineSender
from sim_devices.instruments.serial_lines.loadstar import Loadstar, LoadstarOptions
from sim_devices.instruments.serial_lines.mantracourt import Mantracourt, MantracourtOptions
from sim_devices.instruments.serial_lines.mt_sics import MtSics
from sim_devices.instruments.serial_lines.mt_sics_options import MtSicsOptions
from sim_devices.instruments.serial_lines.nortek import Nortek, NortekOptions
from sim_devices.instruments.serial_lines.sartorius import Sartorius, SartoriusOptions
from sim_devices.wires.serial_line import Wire
from sim_devices.world import World
from sim_devices.world.noise import Noise, Normals


def serial_device(
    options: SerialOptions,
    world: World,
    cross_rng: np.random.Generator,
    epoch: datetime,
    force: Callable[[], float] | None = None,
) -> SerialDevice:
    """The device of these options. `force`: what a load cell reads, N; None: the world's, as it is."""
    read = force or (lambda: world.sample("thrust"))
    match options:
        case MtSicsOptions():
            return MtSics(options, read)
        case HbmAedOptions():
            return HbmAed(options, read)
        case MantracourtOptions():
            return Mantracourt(options, read)
        case SartoriusOptions():
            return Sartorius(options, read)
        case LineOptions():
            return LineSender(options, read)
        case LoadstarOptions():
            return Loadstar(options, read)
        case ButtonOptions():
            return Button(options)
        case NortekOptions():
            std = world.settings.noise.get("flow_speed", Noise()).white
            cross = Normals(cross_rng)
            return Nortek(options, lambda: world.sample("flow_speed"), lambda: std * cross.draw(), epoch)
        case KellerOptions():
            return Keller(options, lambda: world.sample("pressure"), lambda: world.sample("water_temperature"))
        case PzemOptions():
            return Pzem(options, lambda: world.sample("bus_voltage"), lambda: world.sample("input_current"))
        case ModbusCellOptions():
            return ModbusCell(options, read)
        case RegistersOptions():
            return RegistersDevice(options, world.sample)


def can_node(options: NodeOptions, world: World, force: Callable[[], float] | None = None) -> CanNode:
    """The device of these options on the CAN bus. `force` as above."""
    if isinstance(options, Cia404Options):
        return Cell404(options, force or (lambda: world.sample("thrust")))
    return CanSender(options, world.sample)


def turnaround(options: SerialOptions) -> float:
    """S from the end of a request, or of the last conversion, to the first byte of what the device says.

    A converter that averages sees its quantity all the time; one value in the middle of each piece stands for it here,
    so that the last piece ends half of it later.
    """
    match options:
        case (
            KellerOptions()
            | PzemOptions()
            | ModbusCellOptions()
            | RegistersOptions()
            | MantracourtOptions()
            | SartoriusOptions()
        ):
            return options.turnaround
        case HbmAedOptions():
            return 0.5 / options.top_rate
        case MtSicsOptions() | LineOptions() if options.average > 1:
            return 0.5 / (options.rate * options.average)
        case _:
            return 0.0


def say(wire: Wire, data: bytes, t: float, late: float) -> None:
    """Hand a device's words to its wire: lines one by one, anything else whole."""
    if data.endswith(b"\r\n"):
        for line in data.splitlines(keepends=True):
            wire.put(line, t, late)
    elif data:
        wire.put(data, t, late)
