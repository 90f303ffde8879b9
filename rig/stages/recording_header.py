"""What a recording says before its first row: every stream with its channels, and both files, verbatim."""

from __future__ import annotations

import json
import math
import uuid
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from drivers.protocols import Channel, Stream
from rig.campaign.bench import COMMAND_STREAM, Bench
from rig.campaign.config import CampaignConfig
from rig.link.recorder_messages import Attribute, ChannelSpec, Open, StreamSpec

BYTES_PER_VALUE = 8
OVERHEAD_BYTES = 2**20
"""Layout, chunks begun and not filled, events."""
OBEYED_STD = 0.002
"""s from a command's row (when it went to the driver) until it is obeyed, which nothing measures: two frames of 1 ms of
an adapter on USB (USB 2.0, section 5.3.3)."""
COMMAND_CHANNEL = ChannelSpec(
    "command_voltage", "command_voltage", "V", delay_std=OBEYED_STD,
    description="what the motor controller was told; rows are changes; NaN: nothing was sent (watchdog proof)",
)  # fmt: skip


class Stamp(NamedTuple):
    """What tells one recording from every other."""

    recording_id: str
    created: str
    """ISO 8601, UTC."""


def fresh_stamp() -> Stamp:
    """An id that no other recording has, and the time now."""
    return Stamp(str(uuid.uuid4()), datetime.now(UTC).isoformat())


def opening(
    campaign: CampaignConfig,
    bench: Bench,
    thruster: str,
    path: Path,
    t0_ns: int,
    stamp: Stamp,
    attempt: int = 1,
    continues: str = "",
) -> Open:
    """The Open message of one run; `attempt` counts the runs of that thruster in this campaign, from 1.

    `continues`: id of the recording whose run it goes on with; empty: it is a whole one.
    """
    streams = [
        stream_spec(stream, bench.identities.get(device, ""), device == bench.config.force)
        for device, stream in bench.streams()
    ]
    streams.append(StreamSpec(COMMAND_STREAM, "rig", (COMMAND_CHANNEL,)))
    size = expected_bytes((stream for _, stream in bench.streams()), campaign)
    attributes = _attributes(campaign, thruster, stamp, attempt)
    if continues:
        attributes["continues"] = continues
    return Open(str(path), t0_ns, tuple(streams), attributes, size)


def stream_spec(stream: Stream, device_id: str, primary: bool) -> StreamSpec:
    """One group of the recording; the thrust of the bench's force device gets the role `primary`."""
    channels = tuple(_channel_spec(channel, primary) for channel in stream.channels)
    period = None if stream.clock_drift_std is None else stream.period_s
    return StreamSpec(
        stream.name, stream.source, channels, device_id, period=period, clock_drift_std=stream.clock_drift_std
    )


def expected_bytes(streams: Iterable[Stream], campaign: CampaignConfig) -> int:
    """Size of one run's file by the plan's longest duration."""
    longest = campaign.plan.duration().worst
    rows_and_columns = sum(math.ceil(longest / s.period_s) * (len(s.channels) + 1) for s in streams)
    commands = math.ceil(longest * campaign.bench.loop_rate) * 2
    return OVERHEAD_BYTES + BYTES_PER_VALUE * (rows_and_columns + commands)


def _channel_spec(channel: Channel, primary: bool) -> ChannelSpec:
    calibration = channel.calibration
    if primary and channel.quantity == "thrust":
        calibration = json.dumps({**json.loads(calibration or "{}"), "role": "primary"})
    return ChannelSpec(
        channel.name,
        channel.quantity,
        channel.unit,
        integer=channel.integer,
        noise_std=channel.noise_std,
        quantum=channel.quantum,
        rounding=channel.rounding,
        delay=channel.delay,
        delay_std=channel.delay_std,
        window=channel.window,
        low_pass=channel.low_pass,
        filter=channel.filter,
        range_min=channel.range_min,
        range_max=channel.range_max,
        calibration=calibration,
        description=channel.description,
    )


def _attributes(campaign: CampaignConfig, thruster: str, stamp: Stamp, attempt: int) -> dict[str, Attribute]:
    attributes: dict[str, Attribute] = {
        "recording_id": stamp.recording_id,
        "created": stamp.created,
        "thruster": thruster,
        "attempt": attempt,
        "kind": campaign.kind,
        "campaign": campaign.name,
        "operator": campaign.operator,
        "facility": campaign.bench.facility,
        "notes": campaign.notes,
        "software": f"thruster-rig {version('thruster-rig')}",
        "bench_toml": campaign.bench.text,
        "campaign_toml": campaign.text,
    }
    if campaign.bench.water_density is not None:
        attributes["water_density"] = campaign.bench.water_density
    return attributes
