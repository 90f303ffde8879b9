"""A bench to simulate, as read from `world.toml`: the world, its devices, ports and scripted faults."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sim_devices.instruments.button import ButtonOptions
from sim_devices.instruments.can_signals import CanSignalsOptions
from sim_devices.instruments.canopen.cell import Cia404Options
from sim_devices.instruments.canopen.drive_options import Cia402Options
from sim_devices.instruments.canopen.output import Cia401Options
from sim_devices.instruments.dronecan.options import DronecanEscOptions
from sim_devices.instruments.modbus.keller import KellerOptions
from sim_devices.instruments.modbus.pzem import PzemOptions
from sim_devices.instruments.modbus.registers import ModbusCellOptions
from sim_devices.instruments.modbus.registers_device import RegistersOptions
from sim_devices.instruments.odrive.options import ODriveOptions
from sim_devices.instruments.pololu.maestro import MaestroOptions
from sim_devices.instruments.pololu.smc import SmcG2Options
from sim_devices.instruments.roboteq.options import RoboteqOptions
from sim_devices.instruments.scpi.supply import ScpiSupplyOptions
from sim_devices.instruments.serial_lines.hbm_aed import HbmAedOptions
from sim_devices.instruments.serial_lines.line_sender import LineOptions
from sim_devices.instruments.serial_lines.loadstar import LoadstarOptions
from sim_devices.instruments.serial_lines.mantracourt import MantracourtOptions
from sim_devices.instruments.serial_lines.mt_sics_options import MtSicsOptions
from sim_devices.instruments.serial_lines.nortek import NortekOptions
from sim_devices.instruments.serial_lines.sartorius import SartoriusOptions
from sim_devices.instruments.vesc.controller import VescOptions
from sim_devices.instruments.vesc.over_uart import VescUartOptions
from sim_devices.tables import WorldError, build, check_known
from sim_devices.world.settings import WORLD_TABLES, WorldSettings, read_world
from sim_devices.world.twin import with_twin

SerialOptions = (
    MtSicsOptions
    | HbmAedOptions
    | MantracourtOptions
    | SartoriusOptions
    | LineOptions
    | LoadstarOptions
    | PzemOptions
    | ButtonOptions
    | NortekOptions
    | KellerOptions
    | ModbusCellOptions
    | RegistersOptions
)
"""Of what measures, on a serial port."""
NodeOptions = CanSignalsOptions | Cia404Options
"""Of what measures, on the CAN bus."""
MotorOptions = (
    MaestroOptions
    | DronecanEscOptions
    | ODriveOptions
    | RoboteqOptions
    | VescOptions
    | Cia402Options
    | Cia401Options
    | VescUartOptions
    | ScpiSupplyOptions
    | SmcG2Options
)
DeviceOptions = SerialOptions | NodeOptions | MotorOptions
MOTORS = (
    MaestroOptions,
    DronecanEscOptions,
    ODriveOptions,
    RoboteqOptions,
    VescOptions,
    Cia402Options,
    Cia401Options,
    VescUartOptions,
    ScpiSupplyOptions,
    SmcG2Options,
)
"""Those that turn the thruster."""
NODES = (CanSignalsOptions, Cia404Options)
"""Those that measure, on the CAN bus."""
KINDS: dict[str, type[DeviceOptions]] = {
    "mt_sics": MtSicsOptions,
    "hbm_aed": HbmAedOptions,
    "mantracourt_dsc": MantracourtOptions,
    "sartorius_sbi": SartoriusOptions,
    "line": LineOptions,
    "loadstar": LoadstarOptions,
    "button": ButtonOptions,
    "nortek": NortekOptions,
    "keller": KellerOptions,
    "pzem": PzemOptions,
    "modbus_cell": ModbusCellOptions,
    "modbus_registers": RegistersOptions,
    "can_signals": CanSignalsOptions,
    "maestro": MaestroOptions,
    "dronecan_esc": DronecanEscOptions,
    "odrive": ODriveOptions,
    "roboteq": RoboteqOptions,
    "smc_g2": SmcG2Options,
    "vesc_uart": VescUartOptions,
    "scpi_supply": ScpiSupplyOptions,
    "vesc": VescOptions,
    "cia402": Cia402Options,
    "cia401": Cia401Options,
    "cia404": Cia404Options,
}
MAX_STEP = 0.005
"""s: the rotor's fastest time constant is 0.07 s."""


@dataclass(frozen=True, slots=True)
class ScriptedFault:
    """`[[faults]]`: `device` has `fault` from `at` (s after the start) for `duration` (s; 0: for good)."""

    device: str
    fault: str
    at: float
    duration: float = 0.0
    amount: float = 0.1


@dataclass(frozen=True, slots=True)
class CanBus:
    """`[can]`"""

    adapters: tuple[str, ...] = ("can0", "can1")
    """Names of slcan ports, all on one bus."""


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """All of a world file. Paths are absolute."""

    world: WorldSettings
    devices: Mapping[str, DeviceOptions]
    can: CanBus
    links: Path
    truth: Path | None
    seed: int
    step: float
    """s of world time per step."""
    faults: tuple[ScriptedFault, ...]


KEYS = ("seed", "links", "truth", "step", "can", "devices", "faults", *WORLD_TABLES)


def load(path: Path) -> BenchSettings:
    """Read a world file. Raises WorldError naming file, table and what to do."""
    try:
        with path.open("rb") as file:
            tables = tomllib.load(file)
    except OSError as error:
        raise WorldError(f"{path}: cannot be read ({error.strerror}); give the path of a world file") from error
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"{path}: is not TOML: {error}") from error
    try:
        folder = path.resolve().parent
        return _from_tables(with_twin(tables, folder), folder)
    except WorldError as error:
        raise WorldError(f"{path}: {error}") from error


def _from_tables(tables: Mapping[str, Any], folder: Path) -> BenchSettings:
    for key in tables:
        check_known(key, KEYS, "world file")
    step = tables.get("step", 0.001)
    if not isinstance(step, float) or not 0 < step <= MAX_STEP:
        raise WorldError(f"step: expected seconds above 0 and at most {MAX_STEP}, got {step!r}")
    seed = tables.get("seed", 0)
    if not isinstance(seed, int) or seed < 0:
        raise WorldError(f"seed: expected a whole number from 0, got {seed!r}")
    devices = {name: _device(name, table) for name, table in tables.get("devices", {}).items()}
    truth = tables.get("truth", "")
    settings = BenchSettings(
        world=read_world({key: tables[key] for key in WORLD_TABLES if key in tables}),
        devices=devices,
        can=build(CanBus, tables.get("can", {}), "can"),
        links=folder / tables.get("links", "ports"),
        truth=folder / truth if truth else None,
        seed=seed,
        step=step,
        faults=tuple(build(ScriptedFault, t, f"faults[{i}]") for i, t in enumerate(tables.get("faults", []))),
    )
    motors = [name for name, options in devices.items() if isinstance(options, MOTORS)]
    if len(motors) > 1:
        raise WorldError(f"devices: one motor controller turns the one thruster, got {', '.join(motors)}")
    return settings


def _device(name: str, table: Any) -> DeviceOptions:
    kind = table.get("kind") if isinstance(table, Mapping) else None
    if not isinstance(kind, str):
        raise WorldError(f"devices.{name}: expected a table with kind = one of {', '.join(KINDS)}, got {table!r}")
    check_known(kind, KINDS, f"devices.{name}.kind")
    return build(KINDS[kind], table, f"devices.{name}")


def script(faults: tuple[ScriptedFault, ...]) -> list[tuple[float, bool, ScriptedFault]]:
    """(s, begins, fault) in order of time."""
    begins = [(each.at, True, each) for each in faults]
    ends = [(each.at + each.duration, False, each) for each in faults if each.duration > 0]
    return sorted(begins + ends, key=lambda entry: entry[0])
