"""A recording as its quantities were, from how it says that they were acquired: stamps brought back to the samples.

What a recording says of its own chain (conversion, filter, transport, averaging, the device's clock) is no physics of
the thruster, and is taken away before any is looked for. What it does not say stays as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare.chain.sample_clock import sample_times
from identification.recording import Channel, Floats, Recording


def as_sampled(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording with each sample at the time that its value is of, and a sentence for each stream changed so.

    Rows of a device with an even clock of its own (`period` and `clock_drift_std`) are put on that clock; then
    `delay` and half of `window` are taken off, but for what a low pass delays thrust: a model predicts that. Values
    that were cut toward zero get half a `quantum` back.
    """
    clocks: dict[str, Floats] = {}
    told: dict[str, str] = {}
    channels = []
    for channel in recording.channels:
        if channel.stream not in clocks:
            clocks[channel.stream], told[channel.stream] = _clock(channel)
        channels.append(_uncut(_moved(channel, clocks[channel.stream])))
        if _is_cut(channel):
            told[channel.stream] += f"; {channel.name} half a step from zero, for its device cuts toward it, as stated"
        late = _late(channel)
        if late > 0:
            told[channel.stream] += f"; {channel.name} {1e3 * late:.3g} ms before its stamp, as stated"
    sentences = tuple(f"{stream}: {says.removeprefix('; ')}" for stream, says in told.items() if says)
    return (replace(recording, channels=tuple(channels)) if sentences else recording), sentences


def _clock(channel: Channel) -> tuple[Floats, str]:
    """Times of the stream's rows before any delay, and what was done to them."""
    how = channel.acquisition
    if how.period is None or how.clock_drift_std is None or channel.time.size < policy.prepare.CLOCK_ROWS:
        return channel.time, ""
    clock = sample_times(channel.time, how.period)
    if clock is None:
        return channel.time, "its rows do not come as its clock would tick, and stay where they were stamped"
    late = channel.time - clock
    usual, most = 1e3 * float(np.median(late)), 1e3 * float(np.max(late))
    return clock, f"put on its own clock (rows came up to {most:.3g} ms late, {usual:.2g} ms by the median)"


def _late(channel: Channel) -> float:
    """S by which a stamp is after the middle of what the value is of, or of what a low pass made of it."""
    how = channel.acquisition
    modelled = (how.low_pass or 0.0) if channel.quantity == "thrust" else 0.0
    return (how.delay or 0.0) - modelled + 0.5 * (how.window or 0.0)


def _uncut(channel: Channel) -> Channel:
    """Values that a device cut toward zero, by the mean as they were; what reads 0 may have been either sign."""
    if not _is_cut(channel):
        return channel
    step = channel.acquisition.quantum or 0.0
    return replace(channel, value=channel.value + 0.5 * step * np.sign(channel.value))


def _is_cut(channel: Channel) -> bool:
    return channel.acquisition.rounding == "toward_zero" and bool(channel.acquisition.quantum)


def _moved(channel: Channel, clock: Floats) -> Channel:
    late = _late(channel)
    return channel if clock is channel.time and late == 0 else replace(channel, time=clock - late)
