"""A CAN bus that others fill: bytes of an slcan adapter at its full rate, with a device's own frames among them.

    python benchmarks/controller/can_traffic.py LINK RATE [--behind PORT | --counting ID]

A child of full_buses.py. The host opens LINK, a pty. RATE frames a second come there in all, in bursts of a
millisecond, as an adapter on USB hands them over. `--behind PORT`: what comes from that adapter (a simulated bench's)
goes in between, and what the host writes goes to it. `--counting ID`: a VESC of that id at rest, that sends STATUS_5 a
thousand times a second, whose tachometer counts the messages. On SIGTERM it says in a line of JSON what it sent, and
what the host's buffer did not take, between SIGUSR1 and SIGUSR2: before and after nobody may read.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import select
import signal
import sys
import time
import tty
from pathlib import Path

PERIOD = 0.001
"""s between two bursts."""
PING, PONG, STATUS, STATUS_5 = 17, 18, 9, 27
"""comm_can.h, CAN_PACKET_*."""
STATUS_EVERY = 20
"""Bursts to a STATUS, which says that the motor is at rest."""
SUPPLY = 480
"""0.1 V, as STATUS_5 tells it."""
LATEST = 0.02
"""s of bursts that are made up for after the machine stalled; an adapter's own buffer holds no more."""


def frame(identifier: int, data: bytes) -> bytes:
    return f"T{identifier:08X}{len(data):d}{data.hex().upper()}\r".encode()


class Bus:
    """Of one host: what is on its way to it."""

    def __init__(self, link: Path) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._slave))
        self._left = b""
        self.frames = self.counted = self.lost = 0

    def say(self, data: bytes) -> None:
        """All of it, or, when the host does not read, nothing more than its buffer takes: an adapter that overruns."""
        data = self._left + data
        self._left = b""
        while data:
            try:
                data = data[os.write(self.master, data) :]
            except BlockingIOError:
                whole = data.find(b"\r") + 1  # the line that has begun goes out later, those behind it are lost
                self._left = data[:whole]
                self.lost += data[whole:].count(b"\r")
                return

    def hear(self) -> bytes:
        try:
            return os.read(self.master, 65536)
        except OSError:
            return b""


def burst(bus: Bus, many: int, counting: int | None) -> bytes:
    """So many frames of somebody else's devices, and the next STATUS_5."""
    others = [frame(0x0A000000 + (bus.frames + k) % 4096, (bus.frames + k).to_bytes(8, "big")) for k in range(many)]
    bus.frames += many
    if counting is not None:
        bus.counted += 1
        said = bus.counted.to_bytes(4, "big") + SUPPLY.to_bytes(2, "big") + bytes(2)
        others.insert(many // 2, frame(STATUS_5 << 8 | counting, said))
        if bus.counted % STATUS_EVERY == 0:
            others.append(frame(STATUS << 8 | counting, bytes(8)))
    return b"".join(others)


def answer(heard: bytes, counting: int) -> bytes:
    """PONG to each PING to that id: its first byte is who asks."""
    asked = f"T{PING << 8 | counting:08X}1".encode()
    who = [int(line[len(asked) : len(asked) + 2], 16) for line in heard.split(b"\r") if line.startswith(asked)]
    return b"".join(frame(PONG << 8 | host, bytes([counting, 0])) for host in who)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("link", type=Path)
    parser.add_argument("rate", type=float)
    parser.add_argument("--behind", type=Path)
    parser.add_argument("--counting", type=int)
    asked = parser.parse_args()
    bus, ended = Bus(asked.link), list[int]()
    behind = os.open(asked.behind, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK) if asked.behind else None
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    counts = list[tuple[int, int]]()
    for number in (signal.SIGUSR1, signal.SIGUSR2):
        signal.signal(number, lambda *_: counts.append((bus.frames + bus.counted, bus.lost)))
    print("ready", flush=True)
    each, owed, due = asked.rate * PERIOD, 0.0, time.monotonic()
    half = b""
    while not ended:
        ports = [bus.master] + ([behind] if behind is not None else [])
        select.select(ports, [], [], max(due - time.monotonic(), 0.0))
        heard = bus.hear()
        if behind is not None:
            if heard:
                os.write(behind, heard)
            with contextlib.suppress(BlockingIOError):
                half += os.read(behind, 65536)
            whole = half.rfind(b"\r") + 1
            if whole:  # a line in one piece: bursts go between lines
                bus.say(half[:whole])
                half = half[whole:]
        elif heard and asked.counting is not None:
            bus.say(answer(heard, asked.counting))
        now = time.monotonic()
        due = max(due, now - LATEST)
        while due <= now:
            owed += each
            bus.say(burst(bus, int(owed), asked.counting))
            owed -= int(owed)
            due += PERIOD
    (begun, lost_before), (sent, lost) = counts
    print(json.dumps({"frames": sent - begun, "lost": lost - lost_before}), flush=True)
    sys.exit(0)


if __name__ == "__main__":
    main()
