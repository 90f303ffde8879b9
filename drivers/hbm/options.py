"""What a bench file says of AED electronics, and the stream that follows from it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Literal

from drivers.acquisition import Acquisition
from drivers.hbm.frames import ASCII, BINARY, CHARACTERS, FULL_SCALE
from drivers.ports.lines import (
    check_line_rate,
    line_time,
)
from drivers.ports.serial_port import SerialSettings
from drivers.protocols import QUARTZ, Channel, Stream

SLOWEST = 7
"""ICR: every step halves the rate (AD104 manual p. 38, AD101B manual p. 27)."""
RATE_TOLERANCE = 0.05
"""Manuals round their rates: 12 for 12.5, 4.7 for 4.688."""
LARGEST = 8_388_607
"""Digits: three bytes."""


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind hbm_aed. No `window`: 1 / rate where rate is below top_rate, as the manual says."""

    port: str
    rate: float
    """Values/s: top_rate, its half, its quarter ... (ICR)."""
    top_rate: float
    """Values/s at ICR 0: 100 of an AD104, 600 of an AD101B, AD103C or FIT."""
    nominal_force: float
    """N at nominal load of the characteristic that is in the electronics (LDW, LWT or SZA, SFA)."""
    nominal_value: int = 0
    """NOV, digits at nominal load; it is compared. 0: not scaled."""
    format: Literal["binary", "ascii"] = "binary"
    """COF 8 or COF 9."""
    address: int | None = None
    """On a bus of several: selected first (S00 to S31). None: one device, nothing is selected."""
    baud: int = 9600
    framing: str = "8E1"
    filter_mode: int | None = None
    """FMD; None: as it is set."""
    filter_stage: int | None = None
    """ASF; None: as it is set."""
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 1.0
    """s for an answer."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        if self.format not in ("binary", "ascii"):
            raise ValueError(f"hbm_aed format must be binary or ascii, not {self.format!r}")
        check_line_rate("hbm_aed", self.rate, self.baud, self.framing, CHARACTERS[self.output_format])
        self._check_rate()
        self._check_scale()
        if self.address is not None and not 0 <= self.address <= 31:
            raise ValueError(f"hbm_aed address must be 0 to 31, not {self.address}")
        for name, stage in (("filter_mode", self.filter_mode), ("filter_stage", self.filter_stage)):
            if stage is not None and not 0 <= stage <= 99:
                raise ValueError(f"hbm_aed {name} must be 0 to 99, not {stage}")
        self.check_acquisition("hbm_aed")
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"hbm_aed timeout must be between 0 and 60 s, not {self.timeout}")

    def _check_rate(self) -> None:
        if not 0.0 < self.top_rate < math.inf:
            raise ValueError(f"hbm_aed top_rate must be positive, not {self.top_rate}")
        rates = [self.top_rate / 2**code for code in range(SLOWEST + 1)]
        if not any(abs(self.rate / each - 1.0) <= RATE_TOLERANCE for each in rates):
            raise ValueError(
                f"hbm_aed has no rate of {self.rate:g}/s with a top_rate of {self.top_rate:g}/s, but "
                + ", ".join(f"{each:.4g}" for each in rates)
            )

    def _check_scale(self) -> None:
        if not 0.0 < self.nominal_force < math.inf:
            raise ValueError(f"hbm_aed nominal_force must be positive and in N, not {self.nominal_force}")
        if not 0 <= self.nominal_value <= LARGEST:
            raise ValueError(f"hbm_aed nominal_value must be 0 to {LARGEST} digits (NOV), not {self.nominal_value}")
        if self.sign not in (1, -1):
            raise ValueError(f"hbm_aed sign must be 1 or -1, not {self.sign}")

    @property
    def output_format(self) -> int:
        """COF."""
        return BINARY if self.format == "binary" else ASCII

    @property
    def rate_code(self) -> int:
        """ICR."""
        return round(math.log2(self.top_rate / self.rate))

    @property
    def newtons_per_digit(self) -> float:
        return self.sign * self.nominal_force / (self.nominal_value or FULL_SCALE[self.output_format])


def stream(name: str, options: Options) -> Stream:
    calibration = {
        "formula": "thrust = newtons_per_digit * raw", "newtons_per_digit": options.newtons_per_digit,
        "nominal_force": options.nominal_force, "nominal_value": options.nominal_value, "gain_std": options.gain_std,
    }  # fmt: skip
    on_the_line = line_time(options.baud, options.framing, CHARACTERS[options.output_format])
    averaged = 1.0 / options.rate if options.rate_code else None
    thrust = Channel(
        "thrust", "thrust", "N", noise_std=options.noise_std, quantum=abs(options.newtons_per_digit),
        delay=options.delay + on_the_line, delay_std=options.delay_std,
        window=averaged if options.window is None else options.window, low_pass=options.low_pass,
        filter=options.filter, range_min=options.range_min, range_max=options.range_max,
        calibration=json.dumps(calibration),
    )  # fmt: skip
    channels = (
        thrust,
        Channel("stable", None, "1", description="1: the electronics call the value at a standstill"),
        Channel("status", None, "1", integer=True, description="status byte as sent"),
        Channel("raw", None, "1", integer=True, description="digits as sent"),
    )
    return Stream(name, "hbm_aed", channels, 1.0 / options.rate, QUARTZ)
