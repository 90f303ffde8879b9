"""How fast is each decoder of `drivers` on one core, and which share of it does a line that is full need?

    python benchmarks/decoders.py [SECONDS]

Sound input of each, as benchmarks/fuzz.py begins with, again and again. Serial lines: 115,200 baud of 8N1, 11,520
bytes/s; CAN: 1 Mbit/s, 7,000 frames/s of 29 bits and 8 bytes. What the port modules add (waiting, stamps, queues) is
in benchmarks/controller/full_buses.py.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from fuzzing import of_can, of_serial

SERIAL = 11_520
"""Bytes/s."""
CAN = 7_000
"""Frames/s."""


def rate(decode: of_serial.Decode, inputs: Sequence[bytes], seconds: float) -> float:
    """Rounds over all of `inputs` in a second of this process."""
    for data in inputs:
        decode(data)
    rounds, begun = 0, time.process_time()
    while (spent := time.process_time() - begun) < seconds:
        for data in inputs:
            decode(data)
        rounds += 1
    return rounds / spent


def main(seconds: float) -> int:
    print(f"{'decoder':24}{'units':>10}{'units/s':>14}{'us each':>10}{'share of a core at a full line':>34}")
    for name, (inputs, decode) in of_serial.decoders().items():
        sound = [data for data in inputs if data]
        each_s = rate(decode, sound, seconds) * sum(map(len, sound))
        print(f"{name:24}{'bytes':>10}{each_s:>14,.0f}{1e6 / each_s:>10.3f}{100 * SERIAL / each_s:>33.2f} %")
    for name, (inputs, decode) in of_can.decoders().items():
        each_s = rate(decode, inputs, seconds) * len(inputs)
        print(f"{name:24}{'frames':>10}{each_s:>14,.0f}{1e6 / each_s:>10.3f}{100 * CAN / each_s:>33.2f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 1.0))
