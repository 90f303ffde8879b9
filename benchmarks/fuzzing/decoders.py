"""Frames and lines into every decoder of `drivers`, and frames of the sockets: a record or an error that is meant."""

from __future__ import annotations

import functools
import math
import operator
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drivers.modbus import keller, pzem, rtu
from drivers.pololu import packets
from drivers.ports.can_frame import Frame
from drivers.roboteq import lines as roboteq_lines
from drivers.serial_lines import line_stream, loadstar_lines, mt_sics_lines, nortek_nmea
from drivers.vesc import can_frames, uart_packets
from rig.errors import LinkError
from rig.link.framing import HEADER, decode, encode
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Ack, EventRow, Rows

from .mutation import Tally, mutant

Decode = Callable[[bytes], Any]
LINES = (b"S S     12.345 N\r\n", b"S D    -0.001 kg\r\n", b"S I\r\n", b"S S Error 1b\r\n", b'I2 A "WMF204C"\r\n')
NMEA = (
    b"$PNORC1,083013,132455,1,0.50,0.332,-0.332,0.1,79.3,79.3,79.3,28,28,28*46\r\n",
    b"$PNORI,4,Test,4,21,0.20,1.00,0*2D\r\n",
    b"$VMVEL,,1,0.123,0.456,-0.789*5A\r\n",
    b"$PNORS,1,2,3*00\r\n",
)
STREAM = (b"-8388608\r\n", b"17;-1.5 N raw=12\r\n", b"19;1.0 N raw=x\r\n")
CAN = tuple(
    struct.pack(">I", packet << 8 | 7) + data
    for packet, data in (
        (9, bytes(8)),
        (16, bytes(8)),
        (27, bytes(8)),
        (18, b"\x07"),
        (8, bytes([7, 0, 51, 0, 0, 4, 0, 1])),
    )
)
MODBUS = tuple(
    bytes.fromhex(frame)
    for frame in (
        "01 03 10 08 80 00 00 30 39 00 00 2e e0 00 00 00 00 00 03 d0 78",
        "01 83 02 c0 f1",
        "01 03 00 06 00 08 a4 0d",
    )
)
ROBOTEQ = (b"A=100:200\r", b"V=135:246:4730\r", b"BS=-3100\r", b"+\r-\r", b"FID=Roboteq v2.1\r", b"!G 1 250\r")
LOADSTAR = (b"      2.5000\r\n", b"-0000C1\r", b" 7FFFFF\r", b"A\r\n", b"FCM DI-1000\r\n")
VESC_UART = (
    uart_packets.framed(bytes.fromhex("32 00 00 81 cf 013a 00fa 000004d2 00000237 00fc ffffe49c 01e1 02")),
    uart_packets.framed(b"\0\x06\x05SIM\0" + bytes(12)),
    uart_packets.set_duty(0.25),
)
POLOLU = (b"\x70\x17\x00\x00", b"\x71\x17\x20\x00\x07")
PZEM = (struct.pack(">8H", 1254, 523, 6558, 0, 17, 0, 0, 0xFFFF),)
REGISTERS = (b"\x3f\x80\x00\x00", b"\x7f\x80\x00\x00")
MESSAGES = tuple(
    encode(message)
    for message in (
        Request("note", "x" * 40),
        Ack((1, 2), 0.5, 10**9),
        EventRow(1.0, "info", "ü"),
        Rows(0, np.arange(4), np.ones((4, 2))),
    )
)


def _link(data: bytes) -> Any:
    try:
        return decode(data[4] if len(data) > 4 else 0, data[HEADER.size :])
    except LinkError as error:
        return error


def _frame(data: bytes) -> Any:
    number = int.from_bytes(data[:4], "big") & 0x1FFFFFFF
    return can_frames.decode(Frame(number, True, data[4:12]))


def _registers(data: bytes) -> Any:
    words = [int.from_bytes(data[i : i + 2], "big") for i in range(0, len(data) - 1, 2)]
    return keller.decode_float(words[:2]) if len(words) >= 2 else None


def _modbus(data: bytes) -> Any:
    """A new reply to the same request each time, with a checksum that is right in every other one."""
    decoder = rtu.Decoder()
    decoder.expect(rtu.Read(1, 3, 6, 8))
    records = decoder.feed(rtu.framed(data[:-2]) if len(data) % 2 else data)
    return [records, decoder.unanswered()]


def _pololu(data: bytes) -> Any:
    """Four bytes are waited for, as behind each set-point."""
    decoder = packets.Decoder()
    decoder.expect(4)
    records = decoder.feed(data)
    return [records, [each.words for each in records if isinstance(each, packets.Answer)]]


def _pzem(data: bytes) -> Any:
    return pzem.decode(struct.unpack(">8H", data[:16])) if len(data) >= 16 else None


def decoders() -> dict[str, tuple[tuple[bytes, ...], Decode, bool]]:
    """Name -> seeds, the decoder, and whether its numbers must be finite."""
    cell, flow, motor = mt_sics_lines.Decoder(), nortek_nmea.Decoder(), roboteq_lines.Decoder()
    pattern = r"(?:(?P<t>[^;]+);)?(?P<value>[-+.\deEnainf]+)(?: (?P<unit>\w+))?(?: raw=(?P<raw>\S+))?"
    lines, counts = line_stream.Decoder(pattern), line_stream.Decoder(r"(?P<raw>\S+)")
    return {
        "MT-SICS": (LINES, cell.feed, True),
        "Nortek NMEA": (NMEA, flow.feed, True),
        "line stream": (STREAM, lines.feed, True),
        "line stream, counts": (STREAM, counts.feed, True),
        "Modbus RTU": (MODBUS, _modbus, True),
        "VESC on CAN": (CAN, _frame, True),
        "Roboteq": (ROBOTEQ, motor.feed, True),
        "Loadstar": (LOADSTAR, loadstar_lines.Decoder().feed, True),
        "VESC on UART": (VESC_UART, uart_packets.Decoder().feed, True),
        "Pololu": (POLOLU, _pololu, True),
        "PZEM registers": (PZEM, _pzem, True),
        "Keller registers": (REGISTERS, _registers, False),
        "frames of the sockets": (MESSAGES, _link, False),
    }


def _summed(data: bytes) -> bytes:
    """A sentence with a checksum that is right, or nothing behind it would ever be read."""
    body = data.strip(b"$\r\n").rpartition(b"*")[0]
    return b"$%s*%02X\r\n" % (body, functools.reduce(operator.xor, body, 0))


def infinite(record: Any) -> bool:
    """Whether a number in a record is infinite: no instrument measures that."""
    if isinstance(record, float):
        return math.isinf(record)
    return isinstance(record, list | tuple) and any(infinite(item) for item in record)


def run(count: int, seed: int, folder: Path) -> list[Tally]:
    """`count` mutants into each decoder."""
    return [
        _fuzz(name, count, np.random.default_rng([seed, i]), folder, *one)
        for i, (name, one) in enumerate(decoders().items())
    ]


def _fuzz(
    name: str, count: int, rng: np.random.Generator, folder: Path, seeds: tuple[bytes, ...], feed: Decode, finite: bool
) -> Tally:
    tally = Tally(name, folder)
    for number in range(count):
        data = _summed(mutant(rng, seeds)) if seeds is NMEA and number % 2 else mutant(rng, seeds)
        begun = time.process_time()
        try:
            record = feed(data)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is what is looked for
            tally.fail(f"{name.replace(' ', '_')}-{number}", repr(error), data)
            continue
        if finite and infinite(record):
            tally.fail(f"{name.replace(' ', '_')}-{number}", f"an infinite number: {str(record)[:80]}", data)
        else:
            tally.add("decoded or refused", time.process_time() - begun)
    return tally
