"""How Pololu's controllers are recognised: in the compact protocol without CRC, where their kind is named.

Any word feeds the command timeout of a Simple Motor Controller and the serial timeout of a Maestro, and an answer is
bare bytes that other devices may give as well. What is asked reads; it sets nothing and clears nothing (Get Errors of
the Maestro would). The Pololu protocol is not tried: the number of a Simple Motor Controller, 13, is an end of line to
others.
"""

from __future__ import annotations

from drivers.pololu.maestro import GET_POSITION
from drivers.pololu.maestro_options import QUARTERS
from drivers.pololu.packets import Answer, Packets
from drivers.pololu.smc import FIRMWARE_BYTES, GET_FIRMWARE, GET_VARIABLE
from drivers.pololu.smc_options import ERROR_STATUS, FULL, INPUT_VOLTAGE, SPEED, errors, signed
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe

RATES = (Rate(115200), Rate(9600))
"""Over USB it does not matter."""
CHANNELS = range(6)
"""Of the smallest Maestro."""
SHORTEST, LONGEST = 64 * QUARTERS, 4080 * QUARTERS
"""Quarters of a microsecond that a channel can be set to (0J40, 4.d)."""
WATCHDOG = "cannot be asked; off as delivered; the rig measures it before it arms"


def _hear(_line: Line) -> Found | None:
    """They say nothing by themselves."""
    return None


def _words(line: Line, length: int, command: int, *data: int) -> tuple[int, ...] | None:
    """The answer to one question; None: there is none of that length."""
    said = line.ask(Packets().encode(command, *data), lambda came: len(came) >= length)
    return Answer(said).words if len(said) == length else None


def _smc(line: Line) -> Found | None:
    firmware = _words(line, FIRMWARE_BYTES, GET_FIRMWARE)
    speed = _words(line, 2, GET_VARIABLE, SPEED) if firmware else None
    supply = _words(line, 2, GET_VARIABLE, INPUT_VOLTAGE) if speed else None
    stops = _words(line, 2, GET_VARIABLE, ERROR_STATUS) if supply else None
    if firmware is None or speed is None or supply is None or stops is None or abs(signed(speed[0])) > FULL:
        return None
    product, version = firmware
    volts = f"{supply[0] * 1e-3:g} V measured now"
    return Found(
        "smc_g2",
        f"Pololu Simple Motor Controller, product {product}, firmware {version >> 8:x}.{version & 0xFF:02x}",
        "motor",
        {},
        {
            "nominal_bus_voltage": f"V of the supply; the command is a share of it ({volts})",
            "watchdog_timeout": "s, command timeout as set in the Simple Motor Control Center (off as delivered)",
        },
        (f"speed {signed(speed[0])} of {FULL}, stopped by: {errors(stops[0]) or 'nothing'}",),
        "sends nothing until it is asked",
        WATCHDOG,
    )


def _maestro(line: Line) -> Found | None:
    places = []
    for channel in CHANNELS:
        word = _words(line, 2, GET_POSITION, channel)
        if word is None or (word[0] and not SHORTEST <= word[0] <= LONGEST):
            return None
        places.append(word[0])
    pulses = ", ".join(f"{place / QUARTERS:g} us" if place else "no pulses" for place in places)
    return Found(
        "maestro",
        "Pololu Maestro, compact protocol",
        "motor",
        {},
        {
            "channel": "the Maestro's output that the ESC is on",
            "full_voltage": "V that max_pulse (1900 us unless set) stands for",
            "dead_zone": "us on each side of neutral in which the ESC does not drive",
            "watchdog_timeout": "s, serial timeout as set in the Maestro Control Center (off as delivered)",
        },
        (f"channels 0 to {CHANNELS[-1]}: {pulses}",),
        "sends nothing until it is asked",
        WATCHDOG,
    )


SMC = SerialProbe(
    rates=RATES,
    asks="firmware and three variables, in the compact protocol",
    hear=_hear,
    ask=_smc,
    named_only=True,
)
MAESTRO = SerialProbe(
    rates=RATES,
    asks="the positions of channels 0 to 5, in the compact protocol",
    hear=_hear,
    ask=_maestro,
    named_only=True,
)
