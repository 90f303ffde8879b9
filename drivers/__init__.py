"""Wires: bytes to SI numbers and back. Knows no campaign, file or screen.

`KINDS` is the list of devices that a bench file can name. A new device is one file in the folder of its family and
one line here
(docs/howto/add-a-device.md).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from drivers.can_signals import signals as can_signals
from drivers.canopen import anonymising as anonymising_canopen
from drivers.canopen import recognising as recognising_canopen
from drivers.canopen.cia401_options import Options as Cia401Options
from drivers.canopen.cia402_options import Options as Cia402Options
from drivers.canopen.cia404_options import Options as Cia404Options
from drivers.dronecan import recognising as recognising_dronecan
from drivers.dronecan.options import Options as DronecanEscOptions
from drivers.extras import of_extra
from drivers.hbm import anonymising as anonymising_hbm
from drivers.hbm import recognising as recognising_hbm
from drivers.hbm.aed import HbmAed
from drivers.hbm.options import Options as HbmAedOptions
from drivers.modbus import anonymising as anonymising_modbus
from drivers.modbus import keller, pzem
from drivers.modbus import recognising as recognising_modbus
from drivers.modbus.cell import ModbusCell
from drivers.modbus.cell_options import Options as ModbusCellOptions
from drivers.modbus.registers import ModbusRegisters
from drivers.modbus.registers import Options as ModbusRegistersOptions
from drivers.odrive import anonymising as anonymising_odrive
from drivers.odrive import recognising as recognising_odrive
from drivers.odrive.options import Options as ODriveOptions
from drivers.odrive.over_can import ODriveCan
from drivers.pololu import recognising as recognising_pololu
from drivers.pololu.maestro import Maestro
from drivers.pololu.maestro_options import Options as MaestroOptions
from drivers.pololu.smc import SmcG2
from drivers.pololu.smc_options import Options as SmcG2Options
from drivers.ports.anonymous import as_it_is
from drivers.ports.transcript import Chunk
from drivers.protocols import Instrument
from drivers.recognition.can_traffic import CanProbe
from drivers.recognition.serial_line import SerialProbe
from drivers.roboteq import anonymising as anonymising_roboteq
from drivers.roboteq import recognising as recognising_roboteq
from drivers.roboteq.controller import Roboteq
from drivers.roboteq.options import Options as RoboteqOptions
from drivers.scpi import anonymising as anonymising_scpi
from drivers.scpi import recognising as recognising_scpi
from drivers.scpi.options import Options as ScpiSupplyOptions
from drivers.scpi.supply import ScpiSupply
from drivers.serial_lines import anonymising as anonymising_lines
from drivers.serial_lines import (
    line_stream,
    loadstar,
    mantracourt_dsc,
    mt_sics,
    nortek_nmea,
    recognising_cells,
    recognising_mt_sics,
    recognising_streams,
    sartorius_sbi,
)
from drivers.vesc import anonymising as anonymising_vesc
from drivers.vesc import over_can, over_uart, recognising_uart
from drivers.vesc import recognising as recognising_vesc


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of device: its options and how it is built. Building opens nothing."""

    options: type[Any]
    """Frozen dataclass; its `__post_init__` raises ValueError for impossible values."""
    build: Callable[..., Instrument]
    """`build(name, options)` or, over a wire that is given, `build(name, options, wire)` for a serial device;
    `build(name, options, bus)` for one on CAN."""
    link: Literal["serial", "can"]
    probe: SerialProbe | CanProbe | None = None
    """How `rig devices` recognises one; None: it cannot yet."""
    anonymise: Callable[[Sequence[Chunk]], list[Chunk]] | None = None
    """Takes out of a transcript whose device it is; ValueError where that cannot be done; None: nobody knows how."""


def _cia401() -> Callable[..., Instrument]:
    from drivers.canopen.cia401 import Cia401

    return Cia401


def _cia402() -> Callable[..., Instrument]:
    from drivers.canopen.cia402 import Cia402

    return Cia402


def _dronecan_esc() -> Callable[..., Instrument]:
    from drivers.dronecan.esc import DronecanEsc

    return DronecanEsc


def _anonymised_dronecan(chunks: Sequence[Chunk]) -> list[Chunk]:
    from drivers.dronecan.anonymising import anonymise

    return anonymise(chunks)


def _cia404() -> Callable[..., Instrument]:
    from drivers.canopen.cia404 import Cia404

    return Cia404


def _canopen(options: type[Any], load: Callable[[], Callable[..., Instrument]], probe: CanProbe) -> Kind:
    return Kind(options, of_extra("canopen", "canopen", load), "can", probe, anonymising_canopen.anonymise)


KINDS: dict[str, Kind] = {
    "mt_sics": Kind(mt_sics.Options, mt_sics.MtSics, "serial", recognising_mt_sics.PROBE, anonymising_lines.mt_sics),
    "hbm_aed": Kind(HbmAedOptions, HbmAed, "serial", recognising_hbm.PROBE, anonymising_hbm.anonymise),
    "mantracourt_dsc": Kind(
        mantracourt_dsc.Options,
        mantracourt_dsc.MantracourtDsc,
        "serial",
        recognising_cells.MANTRACOURT,
        anonymising_lines.mantracourt,
    ),
    "line_stream": Kind(
        line_stream.Options, line_stream.LineStream, "serial", recognising_streams.NUMBERS, anonymising_lines.numbers
    ),
    "sartorius_sbi": Kind(
        sartorius_sbi.Options, sartorius_sbi.SartoriusSbi, "serial", anonymise=anonymising_lines.sartorius
    ),
    "loadstar": Kind(
        loadstar.Options, loadstar.Loadstar, "serial", recognising_cells.LOADSTAR, anonymising_lines.loadstar
    ),
    "modbus_cell": Kind(
        ModbusCellOptions, ModbusCell, "serial", recognising_modbus.CELL, anonymising_modbus.asked_values
    ),
    "modbus_registers": Kind(ModbusRegistersOptions, ModbusRegisters, "serial"),
    "nortek_nmea": Kind(
        nortek_nmea.Options, nortek_nmea.NortekNmea, "serial", recognising_streams.NORTEK, anonymising_lines.nortek
    ),
    "keller": Kind(keller.Options, keller.Keller, "serial", recognising_modbus.KELLER, anonymising_modbus.asked_values),
    "pzem": Kind(pzem.Options, pzem.Pzem, "serial", recognising_modbus.PZEM, anonymising_modbus.asked_values),
    "maestro": Kind(MaestroOptions, Maestro, "serial", recognising_pololu.MAESTRO, as_it_is),
    "roboteq": Kind(RoboteqOptions, Roboteq, "serial", recognising_roboteq.PROBE, anonymising_roboteq.anonymise),
    "can_signals": Kind(can_signals.Options, can_signals.CanSignals, "can"),
    "scpi_supply": Kind(ScpiSupplyOptions, ScpiSupply, "serial", recognising_scpi.PROBE, anonymising_scpi.anonymise),
    "smc_g2": Kind(SmcG2Options, SmcG2, "serial", recognising_pololu.SMC, as_it_is),
    "odrive_can": Kind(ODriveOptions, ODriveCan, "can", recognising_odrive.PROBE, anonymising_odrive.anonymise),
    "vesc_uart": Kind(
        over_uart.Options, over_uart.VescUart, "serial", recognising_uart.PROBE, anonymising_vesc.anonymise_uart
    ),
    "vesc_can": Kind(over_can.Options, over_can.VescCan, "can", recognising_vesc.PROBE, anonymising_vesc.anonymise),
    "dronecan_esc": Kind(
        DronecanEscOptions,
        of_extra("dronecan", "dronecan", _dronecan_esc),
        "can",
        recognising_dronecan.PROBE,
        _anonymised_dronecan,
    ),
    "cia402": _canopen(Cia402Options, _cia402, recognising_canopen.DRIVE),
    "cia401": _canopen(Cia401Options, _cia401, recognising_canopen.OUTPUT),
    "cia404": _canopen(Cia404Options, _cia404, recognising_canopen.CELL),
}
