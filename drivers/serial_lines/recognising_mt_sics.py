"""How a device that speaks MT-SICS is recognised. `@` is not sent: it would clear a tare."""

from __future__ import annotations

from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.serial_lines.mt_sics_lines import Decoder, Record, Reply, Weight, encode, number

LEAST = 3
"""Weights in a row that are taken for a stream."""


def _hear(line: Line) -> Found | None:
    """A stream that an earlier program left on: `S S value unit`."""
    weights = [record for record in Decoder().feed(line.heard) if isinstance(record, Weight) and record.unit]
    if len(weights) < LEAST:
        return None
    return _found(line, _asked(line, "I2"), streaming=len(weights) / line.heard_for)


def _ask(line: Line) -> Found | None:
    data = _asked(line, "I2")
    return None if data is None or data.status != "A" else _found(line, data)


def _found(line: Line, data: Reply | None, streaming: float | None = None) -> Found:
    number_of_cell, update = _asked(line, "I4"), _asked(line, "UPD")
    rate = number(update.text) if update is not None and update.status == "A" else None
    names = [_text(reply) for reply in (data, number_of_cell) if reply is not None and reply.status == "A"]
    keys: dict[str, object] = {} if rate is None else {"rate": rate}
    untold = {"sign": "1 or -1: -1 where the cell reads forward thrust as negative"}
    if rate is None:
        untold |= {"rate": "readings/s; set_rate = false where the device knows no UPD"}
    unit = next((r.unit for r in Decoder().feed(line.heard) if isinstance(r, Weight) and r.unit), "")
    if not unit:
        unit = _unit(line)
    settings = (
        f"shows {unit}" if unit else "gives no weight now (overloaded, underloaded, or not ready)",
        "auto-zero cannot be asked for everywhere: switch it off, it follows a slow force",
    )
    said = f"sends {streaming:.3g} readings/s by itself" if streaming else "sends nothing until it is asked"
    if rate is not None:
        said += f"; UPD is {rate:g}/s"
    return Found("mt_sics", ", ".join(names) or "MT-SICS device", "force", keys, untold, settings, said)


def _asked(line: Line, command: str) -> Reply | None:
    def answers(data: bytes) -> list[Record]:
        return Decoder().feed(data)

    def enough(data: bytes) -> bool:
        return any(isinstance(each, Reply) and each.command in (command, "ES", "EL", "ET") for each in answers(data))

    came = answers(line.ask(encode(command), enough, 0.5))
    return next((each for each in came if isinstance(each, Reply) and each.command == command), None)


def _unit(line: Line) -> str:
    came = line.ask(encode("SI"), lambda data: b"\n" in data, 0.5)
    return next((each.unit for each in Decoder().feed(came) if isinstance(each, Weight)), "")


def _text(reply: Reply) -> str:
    return reply.text.replace('"', "").strip()


PROBE = SerialProbe(
    rates=(Rate(9600), Rate(38400), Rate(19200), Rate(115200), Rate(57600), Rate(4800), Rate(2400)),
    asks="I2, I4, UPD, SI (who, serial number, rate, one weight)",
    hear=_hear,
    ask=_ask,
)
"""9600 8N1 is the factory's (manual 11780711)."""
