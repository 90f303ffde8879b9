"""What every force sensor's table in a bench file may say of how it measures: late, averaged, filtered, how well."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.ports.lines import HOST_DELAY_STD, check_acquisition, check_gain_std, check_low_pass


@dataclass(frozen=True, slots=True, kw_only=True)
class Acquisition:
    """Keys that the options of such devices have in common. Each says its own part of `delay` in its page."""

    gain_std: float | None = None
    """Relative standard uncertainty (1 sigma) of the calibration, from the certificate."""
    noise_std: float | None = None
    """N, known noise of one value (1 sigma)."""
    delay: float = 0.0
    """s by which a value is behind the force, without the line: conversion, group delay of a filter, half the time
    between two values."""
    delay_std: float = HOST_DELAY_STD
    """s, 1 sigma, of this delay and the computer's."""
    window: float | None = None
    """s that a value is the mean of."""
    low_pass: float | None = None
    """s, time constant of a first-order low pass that a value went through; its group delay is in delay."""
    filter: str = ""
    """What the device does to a value, in words."""

    def check_acquisition(self, kind: str) -> None:
        """Raise ValueError for what no such device does."""
        check_acquisition(kind, delay=self.delay, delay_std=self.delay_std, window=self.window)
        check_gain_std(kind, self.gain_std)
        check_low_pass(kind, self.low_pass, self.delay)
