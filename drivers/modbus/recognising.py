"""How devices that answer Modbus RTU are recognised: registers are read, by functions 3 and 4, and none is written."""

from __future__ import annotations

import math

from drivers.force_units import NEWTONS_PER_UNIT
from drivers.modbus import pzem
from drivers.modbus.keller import P1, TOB1, decode_float
from drivers.modbus.maps import RegisterMap, known_maps, load_map, span
from drivers.modbus.maps.numbers import sane, status, weight
from drivers.modbus.rtu import Decoder, Read, Refusal, Registers
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe

PRESSURES = (-2.0, 1000.0)
"""bar that a pressure transmitter may say."""
TEMPERATURES = (-50.0, 150.0)
"""degC"""
LARGEST = 1e6
"""Of the unit shown; no cell of a thruster's stand bears more."""
LEAST_TEMPERATURE = 1e-3
"""degC: a float that is smaller and not 0 is a whole number taken for a float."""


DRIVING = frozenset((*range(0x83, 0x90), 0x92, 0x9F, 0xA2, 0xA7, 0xA8, 0xAA, 0xFF))
"""Bytes with which a Pololu controller takes the next ones for a set-point, a setting or a script (Maestro guide 5.c to
5.f, Simple Motor Controller G2 guide 6.2): a frame that has one is not sent to a device that nobody knows yet."""


def _hear(_line: Line) -> Found | None:
    """A slave says nothing by itself."""
    return None


def _read(line: Line, request: Read) -> Registers | Refusal | None:
    """A slave refuses what it does not have, so that one that says nothing is not asked again."""

    def reply(data: bytes) -> Registers | Refusal | None:
        decoder = Decoder()
        decoder.expect(request)
        return next((each for each in decoder.feed(data) if isinstance(each, Registers | Refusal)), None)

    if request.address in line.mute:
        return None
    frame = request.encode()
    if DRIVING & set(frame):
        line.withheld.append(
            f"address {request.address} was not asked everything: {frame.hex(' ')} could drive a Pololu controller;"
            " where you know the device, name its kind in a bench file"
        )
        return None
    came = line.ask(frame, lambda data: reply(data) is not None)
    if not came:
        line.mute.add(request.address)
    return reply(came)


def _ask_keller(line: Line) -> Found | None:
    for address in line.addresses:
        pressure, temperature = (_read(line, Read(address, 3, register, 2)) for register in (P1, TOB1))
        if not isinstance(pressure, Registers) or not isinstance(temperature, Registers):
            continue
        bar, degrees = decode_float(pressure.words), decode_float(temperature.words)
        if not _of_water(bar, degrees):
            continue
        return Found(
            "keller",
            f"Keller transmitter (X-line registers), Modbus address {address}",
            keys={"address": address},
            settings=(f"P1 = {bar:.4g} bar, TOB1 = {degrees:.4g} degC (its serial number is not asked for)",),
            rate="sends nothing until it is asked; 2 rows/s by default",
        )
    return None


def _of_water(bar: float, degrees: float) -> bool:
    inside = PRESSURES[0] < bar < PRESSURES[1] and TEMPERATURES[0] < degrees < TEMPERATURES[1]
    return inside and math.isfinite(bar) and abs(degrees) > LEAST_TEMPERATURE


def _ask_pzem(line: Line) -> Found | None:
    """A meter whose power is its voltage times its current."""
    for address in line.addresses:
        reply = _read(line, Read(address, 4, 0, pzem.REGISTERS))
        if not isinstance(reply, Registers):
            continue
        volts, amps, watts, *_ = pzem.decode(reply.words)
        alarms = set(reply.words[6:]) <= {0, 0xFFFF}
        if volts == 0.0 or not alarms or abs(watts - volts * amps) > max(0.3, 0.02 * watts):
            continue
        return Found(
            "pzem",
            f"Peacefair PZEM DC meter, Modbus address {address}",
            keys={"address": address},
            settings=(f"{volts:.4g} V, {amps:.4g} A, {watts:.4g} W (its serial number is not asked for)",),
            rate="sends nothing until it is asked; renews its values about once a second",
        )
    return None


def _ask_cell(line: Line) -> Found | None:
    for address in line.addresses:
        evidence = {name: _evidence(line, address, load_map(name)) for name in known_maps()}
        fitting = sorted((name for name in evidence if evidence[name]), key=lambda name: -evidence[name])
        if fitting:
            return _cell(address, fitting)
    return None


def _evidence(line: Line, address: int, found: RegisterMap) -> int:
    """0: the registers of a map are not there or hold no weight; 1: zeros or trouble; 2: a weight; 3: one as a float,
    which other registers hardly look like."""
    reading = next(iter(found.readings.values()))
    request = Read(address, found.function, *span(found, reading))
    reply = _read(line, request)
    if not isinstance(reply, Registers):
        return 0
    value = weight(reply.words, request.register, found, reading, found.word_order)
    broken = found.status is not None and any(
        status(reply.words, request.register, found) >> bit & 1 for bit in found.status.fault
    )
    if broken or not sane([value], LARGEST):
        return int(broken)
    if reading.type == "float32" and (value != 0.0 or _says_unit(line, address, found)):
        return 3
    return 1 if value == 0.0 else 2


def _says_unit(line: Line, address: int, found: RegisterMap) -> bool:
    if found.unit is None:
        return False
    reply = _read(line, Read(address, found.function, found.unit.register, 1))
    return isinstance(reply, Registers) and bool(found.unit.said(reply.words[0])[1])


def _cell(address: int, fitting: list[str]) -> Found:
    first = load_map(fitting[0])
    untold = {"rate": "polls/s, not above the converter's", "sign": "1 or -1: -1 where forward thrust reads negative"}
    if first.unit is None:
        untold["unit"] = f"as the display shows it: {', '.join(NEWTONS_PER_UNIT)}"
    if first.division is None and next(iter(first.readings.values())).type != "float32":
        untold["decimals"] = "of the display: the number on the wire leaves them out"
    others = f"; the registers of {', '.join(fitting[1:])} are there too" if fitting[1:] else ""
    return Found(
        "modbus_cell",
        f"load-cell transmitter, Modbus address {address}, registers as {first.title}",
        "force",
        {"map": fitting[0], "address": address},
        untold,
        (f"no register says the model: compare it with its label{others}",),
        "sends nothing until it is asked",
    )


RATES = (Rate(9600), Rate(9600, "8E1"), Rate(9600, "8N2"), Rate(19200), Rate(19200, "8E1"), Rate(38400), Rate(115200))

KELLER = SerialProbe(
    rates=RATES[:4], asks="Modbus function 3 (reads P1 and TOB1)", hear=_hear, ask=_ask_keller, order=20
)
"""Before the cells: its floats are no weights, but its registers lie where those of a Laumas do."""
PZEM = SerialProbe(
    rates=(Rate(9600, "8N2"), Rate(9600)),
    asks="Modbus function 4 (reads voltage, current, power)",
    hear=_hear,
    ask=_ask_pzem,
    order=19,
)
"""Before the cells: its registers lie where those of a Dini Argeo do."""
CELL = SerialProbe(
    rates=RATES, asks="Modbus functions 3 and 4 (reads the registers of each map)", hear=_hear, ask=_ask_cell, order=21
)
