"""What a bench file says of a load-cell transmitter on Modbus RTU, checked before anything is opened."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Literal

from drivers.acquisition import Acquisition
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.modbus.maps import Reading, RegisterMap, WordOrder, load_map, span
from drivers.modbus.rtu import REQUEST_CHARACTERS, Read, gap
from drivers.ports.lines import (
    bits_per_character,
    check_line_rate,
    line_time,
)
from drivers.ports.serial_port import SerialSettings


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind modbus_cell."""

    port: str
    map: str
    """`laumas`, `dini_argeo_dgt`, `seneca_z_sg`, or the path of a map file, which ends in .toml."""
    rate: float
    """Polls/s; not above the converter's rate, or values come twice."""
    baud: int = 9600
    framing: str = "8N1"
    address: int = 1
    reading: str = ""
    """Which of the map's readings (`gross`, `net`); empty: its first."""
    unit: str | None = None
    """Unit the device must be set to; None takes the one it says, where its map has a register of that."""
    decimals: int | None = None
    """Of the display, which the number on the wire leaves out; None takes what the device says."""
    word_order: WordOrder | None = None
    """None: the map's."""
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    resolution: float | None = None
    """N, one division of the display; None: what the device says, or one of its last decimal."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 0.25
    """s for a reply."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        found, reading = chosen(self)
        request = Read(self.address, found.function, *span(found, reading))
        pauses = 2 * gap(self.baud, bits := bits_per_character(self.framing)) * self.baud / bits
        characters = REQUEST_CHARACTERS + request.reply_characters + ceil(pauses)
        check_line_rate("modbus_cell", self.rate, self.baud, self.framing, characters)
        taken = line_time(self.baud, self.framing, characters)
        if not taken < self.timeout <= 10.0:
            raise ValueError(
                f"modbus_cell timeout must be between {taken:.3g} s, which request and reply are on the line,"
                f" and 10 s, not {self.timeout}"
            )
        if self.sign not in (1, -1):
            raise ValueError(f"modbus_cell sign must be 1 or -1, not {self.sign}")
        self._check_scale(found, reading)
        self.check_acquisition("modbus_cell")

    def _check_scale(self, found: RegisterMap, reading: Reading) -> None:
        """The number on the wire needs a unit and a decimal point: from the device, or from here."""
        if self.unit is not None and self.unit not in NEWTONS_PER_UNIT:
            raise ValueError(f"modbus_cell unit must be one of {', '.join(NEWTONS_PER_UNIT)}, not {self.unit!r}")
        if self.unit is None and found.unit is None:
            raise ValueError(f"modbus_cell map {self.map} cannot ask for the unit: give unit as the display shows it")
        if reading.type == "float32" and self.decimals is not None:
            raise ValueError(
                "modbus_cell decimals: this reading is a float32, which has its decimal point: leave it out"
            )
        if reading.type != "float32" and self.decimals is None and found.division is None:
            raise ValueError(
                f"modbus_cell map {self.map} cannot ask for the decimal point: give decimals as the display shows them"
            )
        if self.decimals is not None and not 0 <= self.decimals <= 6:
            raise ValueError(f"modbus_cell decimals must be 0 to 6, not {self.decimals}")


def chosen(options: Options) -> tuple[RegisterMap, Reading]:
    """The map, and which of its readings is read. Raises ValueError."""
    found = load_map(options.map)
    name = options.reading or next(iter(found.readings))
    if name not in found.readings:
        raise ValueError(
            f"modbus_cell reading must be one of {', '.join(found.readings)} (map {options.map}), not {name!r}"
        )
    return found, found.readings[name]
