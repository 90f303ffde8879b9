"""How a VESC is recognised on UART or USB: by FW_VERSION, which moves nothing and feeds no timeout."""

from __future__ import annotations

from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.vesc.uart_packets import Decoder, Firmware, Values, ask_firmware, ask_values


def _hear(_line: Line) -> Found | None:
    """It says nothing by itself."""
    return None


def _ask(line: Line) -> Found | None:
    firmware = _answer(line, ask_firmware(), Firmware)
    if firmware is None and line.answers:  # the first question may have met half a packet of somebody else
        firmware = _answer(line, ask_firmware(), Firmware)
    if not isinstance(firmware, Firmware):
        return None
    values = _answer(line, ask_values(), Values)
    now = f" ({values.bus_voltage:g} V measured now)" if isinstance(values, Values) else ""
    fault = f"fault code {values.fault}" if isinstance(values, Values) else "answers no GET_VALUES_SELECTIVE: update it"
    return Found(
        "vesc_uart",
        f"VESC {firmware.hardware}, firmware {firmware.major}.{firmware.minor:02d}, UUID {firmware.uuid or 'not told'}",
        "motor",
        untold={
            "pole_pairs": "of the motor; a wrong one scales the rotation rate and nothing on the wire tells",
            "nominal_bus_voltage": f"V; the duty is volts / this{now}",
            "watchdog_timeout": "s, VESC Tool > App Settings > General > Timeout",
        },
        settings=(fault,),
        rate="sends nothing until it is asked",
        watchdog="cannot be asked on this wire; factory 1 s (appconf_default.h), then it coasts and obeys the next SET"
        " command; the rig measures it before it arms",
    )


def _answer(line: Line, request: bytes, kind: type[Firmware | Values]) -> Firmware | Values | None:
    def found(data: bytes) -> Firmware | Values | None:
        return next((each for each in Decoder().feed(data) if isinstance(each, kind)), None)

    return found(line.ask(request, lambda data: found(data) is not None))


PROBE = SerialProbe(
    rates=(Rate(115200), Rate(9600), Rate(57600), Rate(38400), Rate(230400)),
    asks="FW_VERSION, GET_VALUES_SELECTIVE (which begins the means of its currents anew)",
    hear=_hear,
    ask=_ask,
    order=10,
)
"""115200 8N1 is the factory's (appconf_default.h)."""
