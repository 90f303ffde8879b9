"""The motor controllers of a bench, made of their settings and the world whose thruster they turn."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from sim_devices.bench.settings import MotorOptions
from sim_devices.instruments.can_node import CanNode
from sim_devices.instruments.canopen import drive_options
from sim_devices.instruments.canopen.drive import Drive402
from sim_devices.instruments.canopen.output import Cia401Options, Output401
from sim_devices.instruments.drive import Drive
from sim_devices.instruments.dronecan import options as dronecan
from sim_devices.instruments.dronecan.esc import DronecanEsc
from sim_devices.instruments.motor_tap import MotorTap
from sim_devices.instruments.odrive import options as odrive
from sim_devices.instruments.odrive.axis import ODriveAxis
from sim_devices.instruments.pololu import smc
from sim_devices.instruments.pololu.maestro import Maestro, MaestroOptions
from sim_devices.instruments.roboteq.controller import Roboteq
from sim_devices.instruments.roboteq.options import RoboteqOptions, measured
from sim_devices.instruments.scpi import supply as scpi
from sim_devices.instruments.serial_device import SerialDevice
from sim_devices.instruments.vesc.controller import Vesc, VescOptions
from sim_devices.instruments.vesc.over_uart import VescUart, VescUartOptions
from sim_devices.world import World

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class Motor(NamedTuple):
    """A motor controller as what turns the thruster and as what is on its wire: one of `node` and `serial`."""

    drive: Drive
    node: CanNode | None = None
    serial: tuple[SerialDevice, str, int] | None = None
    """Device, port, baud."""
    after_step: Callable[[float], None] | None = None
    """Called after each world step with its length, s."""
    gain: float = 1.0
    """V at the motor for 1 V of command."""


def motor(options: MotorOptions, world: World, log: Log) -> Motor:
    """The motor controller of these options."""
    supply = world.settings.supply.voltage
    match options:
        case MaestroOptions():
            pulses = Maestro(options, supply, log)
            return Motor(pulses, serial=(pulses, options.port, options.baud))
        case smc.SmcG2Options():
            brushed = smc.SmcG2(options, supply, lambda: smc.measured(world), log)
            return Motor(brushed, serial=(brushed, options.port, options.baud))
        case RoboteqOptions():
            device = Roboteq(options, supply, lambda: measured(world), log)
            return Motor(device, serial=(device, options.port, options.baud))
        case drive_options.Cia402Options():
            measure, gain = lambda: drive_options.measured(world), lambda: world.state.rate_per_volt
            drive = Drive402(options, supply, gain, measure, log)
            return Motor(drive, node=drive)
        case odrive.ODriveOptions():
            gain, seen = lambda: world.state.rate_per_volt, lambda: odrive.measured(world)
            axis = ODriveAxis(options, supply, gain, seen, log)
            return Motor(axis, node=axis)
        case dronecan.DronecanEscOptions():
            gain, told = lambda: world.state.rate_per_volt, lambda: dronecan.measured(world, options.current)
            esc = DronecanEsc(options, supply, gain, told, log)
            return Motor(esc, node=esc)
        case VescUartOptions():
            tap = MotorTap(world, options.pole_pairs, options.vesc_id)
            line = VescUart(Vesc(options.controller(), supply, tap.telemetry, log))
            tap.vesc = line.vesc
            return Motor(line, serial=(line, options.port, options.baud), after_step=tap.after_step)
        case Cia401Options():
            output = Output401(options, supply, log)
            return Motor(output, node=output, gain=options.gain)
        case scpi.ScpiSupplyOptions():
            bench_supply = scpi.ScpiSupply(options, lambda: scpi.measured(world), log)
            return Motor(bench_supply, serial=(bench_supply, options.port, options.baud))
        case VescOptions():
            tap = MotorTap(world, options.pole_pairs, options.vesc_id)
            vesc = tap.vesc = Vesc(options, supply, tap.telemetry, log)
            return Motor(vesc, node=vesc, after_step=tap.after_step)
