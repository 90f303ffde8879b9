"""Decoders of serial lines: sound input of each, and what is asked of it."""

from __future__ import annotations

import functools
import operator
import struct
from collections.abc import Callable
from typing import Any

from drivers.hbm import frames as hbm_frames
from drivers.modbus import keller, pzem, rtu
from drivers.modbus.register_map import RegisterChannel
from drivers.pololu import packets
from drivers.ports.lines import LineCutter
from drivers.roboteq import lines as roboteq_lines
from drivers.scpi import lines as scpi_lines
from drivers.serial_lines import (
    line_stream,
    loadstar_lines,
    mantracourt_lines,
    mt_sics_lines,
    nortek_nmea,
    sartorius_lines,
)
from drivers.vesc import uart_packets

Decode = Callable[[bytes], Any]
MT_SICS = (b"S S     12.345 N\r\n", b"S D    -0.001 kg\r\n", b"S I\r\n", b"S S Error 1b\r\n", b'I2 A "WMF204C"\r\n')
NMEA = (
    b"$PNORC1,083013,132455,1,0.50,0.332,-0.332,0.1,79.3,79.3,79.3,28,28,28*46\r\n",
    b"$PNORI,4,Test,4,21,0.20,1.00,0*2D\r\n",
    b"$VMVEL,,1,0.123,0.456,-0.789*5A\r\n",
    b"$PNORS,1,2,3*00\r\n",
)
STREAM = (b"-8388608\r\n", b"17;-1.5 N raw=12\r\n", b"19;1.0 N raw=x\r\n")
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
MANTRACOURT = (b"+00123.456\r", b"-1.5\r", b"?\r", b"+8192\r")
SARTORIUS = (b"N     +   123.56 g  \r\n", b"-    12.5[6]   \r\n", b"Stat     Err  54    \r\n", b"     High     \r\n")
HBM = (b"+ 512000,31,008\r\n", b"0\r\n", b"AED_AD104\r\n", b"?\r\n")
HBM_BINARY = (b"\x00\x0d\x0a\x08\r\n" * 6, b"\xff\xfe\x00\x02\r\n" * 5)
SCPI = (b"24.003", b"+1.2000E+01V", b"ON", b'-113,"Undefined header"', b"9.9E37", b'+0,"No error"')
VESC_UART = (
    uart_packets.framed(bytes.fromhex("32 00 00 81 cf 013a 00fa 000004d2 00000237 00fc ffffe49c 01e1 02")),
    uart_packets.framed(b"\0\x06\x05SIM\0" + bytes(12)),
    uart_packets.set_duty(0.25),
)
POLOLU = (b"\x70\x17\x00\x00", b"\x71\x17\x20\x00\x07")
PZEM = (struct.pack(">8H", 1254, 523, 6558, 0, 17, 0, 0, 0xFFFF),)
CHANNELS = tuple(RegisterChannel(0, kind, "1", scale=0.1) for kind in ("float32", "i32", "u32"))
REGISTERS = (b"\x3f\x80\x00\x00", b"\x7f\x80\x00\x00")


def decoders() -> dict[str, tuple[tuple[bytes, ...], Decode]]:
    """Name -> seeds and the decoder."""
    pattern = r"(?:(?P<t>[^;]+);)?(?P<value>[-+.\deEnainf]+)(?: (?P<unit>\w+))?(?: raw=(?P<raw>\S+))?"
    binary = hbm_frames.Decoder()
    binary.begin_binary()
    return {
        "MT-SICS": (MT_SICS, mt_sics_lines.Decoder().feed),
        "Nortek NMEA": (NMEA, _with_checksums(nortek_nmea.Decoder().feed)),
        "line stream": (STREAM, line_stream.Decoder(pattern).feed),
        "line stream, counts": (STREAM, line_stream.Decoder(r"(?P<raw>\S+)").feed),
        "Modbus RTU": (MODBUS, _modbus),
        "Modbus registers": (REGISTERS, _registers),
        "Roboteq": (ROBOTEQ, roboteq_lines.Decoder().feed),
        "Loadstar": (LOADSTAR, loadstar_lines.Decoder().feed),
        "Mantracourt": (MANTRACOURT, mantracourt_lines.Decoder().feed),
        "Sartorius": (SARTORIUS, _sartorius),
        "HBM, text": (HBM, hbm_frames.Decoder().feed),
        "HBM, binary": (HBM_BINARY, binary.feed),
        "SCPI": (SCPI, _scpi),
        "VESC on UART": (VESC_UART, uart_packets.Decoder().feed),
        "Pololu": (POLOLU, _pololu),
        "PZEM registers": (PZEM, _pzem),
        "Keller registers": (REGISTERS, _keller),
    }


def _with_checksums(feed: Decode) -> Decode:
    """Of sentences of an odd length the checksum is made right, or nothing behind it would ever be read."""

    def decode(data: bytes) -> Any:
        if len(data) % 2 == 0:
            return feed(data)
        body = data.strip(b"$\r\n").rpartition(b"*")[0]
        return feed(b"$%s*%02X\r\n" % (body, functools.reduce(operator.xor, body, 0)))

    return decode


def _words(data: bytes) -> list[int]:
    return [int.from_bytes(data[i : i + 2], "big") for i in range(0, len(data) - 1, 2)]


def _keller(data: bytes) -> Any:
    words = _words(data)
    return keller.decode_float(words[:2]) if len(words) >= 2 else None


def _registers(data: bytes) -> Any:
    """As a float and as an integer, in both orders of words."""
    words = _words(data)[:2]
    if len(words) < 2:
        return None
    return [channel.value(words, order) for channel in CHANNELS for order in ("high_first", "low_first")]


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


def _sartorius(data: bytes) -> Any:
    return [sartorius_lines.decode(line) for line in LineCutter().feed(data)]


def _pzem(data: bytes) -> Any:
    return pzem.decode(struct.unpack(">8H", data[:16])) if len(data) >= 16 else None


def _scpi(data: bytes) -> Any:
    text = data.decode("ascii", "replace")
    return [scpi_lines.number(text), scpi_lines.error(text)]
