"""What a campaign's page keeps beside its results: environment, people, calibration, configuration, versions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from identification.recording import Channel, Recording
from identification.thruster.thrust_report import digits
from rig.campaign_report.folder import Campaign
from rig.report import page as pages
from rig.report.page import Blanks, Remark, Section, Table, Verbatim, columns, sentences
from rig.report.style import unit_text

ENVIRONMENT: Final = ("water_temperature", "flow_speed", "bus_voltage", "motor_temperature")
"""Quantities that say what a run was made in."""
SIGNED: Final = ("Measured by", "Date", "Signature", "Checked by", "Date", "Signature")
ROLE: Final = "role"
"""Key of a channel's calibration that is no fact of the calibration: which of several cells is modelled."""


def environment_section(campaign: Campaign) -> Section:
    """What was measured of water, supply and motor in each run: mean, and from lowest to highest."""
    quantities = [name for name in ENVIRONMENT if any(r.first_of(name) for r in campaign.recordings)]
    head = ("recording", *(_label(name, campaign.recordings) for name in quantities), "water density / (kg/m³)")
    rows = tuple(
        (
            run.path.name,
            *(_range(run.recording.first_of(name)) for name in quantities),
            f"{run.recording.water_density:g}" if run.recording.water_density is not None else "–",
        )
        for run in campaign.runs
        if run.recording is not None
    )
    table = Table("Mean of each run, and its lowest to its highest value", head, rows)
    lacking = [name.replace("_", " ") for name in ENVIRONMENT if name not in quantities]
    told = [f"Facility: {campaign.said('facility') or 'not stated'}."]
    if lacking:
        told.append(f"Not recorded: {', '.join(lacking)}.")
    return Section("Environment", (*sentences(told), *([table] if rows else [])))


def _label(name: str, recordings: Sequence[Recording]) -> str:
    unit = next(channel.unit for r in recordings if (channel := r.first_of(name)) is not None)
    return f"{name.replace('_', ' ')} / {unit_text(unit).replace('degC', '°C')}"


def _range(channel: Channel | None) -> str:
    """`18.2 (18.1 to 18.3)`, of the values that are numbers."""
    value = channel.value[np.isfinite(channel.value)] if channel is not None else np.zeros(0)
    if not value.size:
        return "–"
    mean = digits(float(value.mean()), float(value.std()))
    return f"{mean} ({value.min():.4g} to {value.max():.4g})".replace("-", "−")


def notes_section(campaign: Campaign) -> Section:
    """Who measured, what was noted before and while it ran."""
    told = [
        f"Operator: {campaign.said('operator') or 'not stated'}.",
        f"Notes of the campaign: {campaign.said('notes') or 'none'}.",
        *_notes(campaign),
    ]
    return Section("Operator and notes", sentences(told))


def _notes(campaign: Campaign) -> Iterator[str]:
    for run in campaign.runs:
        for event in run.recording.events if run.recording is not None else ():
            if event.text.startswith("note: "):
                yield f"{run.path.name} at {event.time:.0f} s: {event.text.removeprefix('note: ')}"


def calibration_section(campaign: Campaign) -> Section:
    """What is stated of each channel that gives a quantity, as the recordings keep it beside the values."""
    head = ("channel", "device", "relative uncertainty of the gain", "noise", "calibration", "recordings")
    found: dict[tuple[str, ...], list[str]] = {}
    silent: dict[str, None] = {}
    for run in campaign.runs:
        for channel in run.recording.channels if run.recording is not None else ():
            if channel.quantity is None:
                continue
            facts = {key: value for key, value in channel.calibration.items() if key != ROLE}
            name = f"{channel.stream}.{channel.name}"
            if not facts and channel.noise_std is None:
                silent[name] = None
                continue
            assert run.recording is not None
            found.setdefault(_calibration_row(name, channel, facts, run.recording), []).append(run.path.name)
    rows = tuple((*row, ", ".join(names)) for row, names in found.items())
    words = columns(head, "channel", "device", "calibration", "recordings")
    table = [Table("As it was in force when it was recorded", head, rows, words)] if rows else []
    told = [Remark(f"No calibration is stated for {', '.join(silent)}.", "doubt")] if silent else []
    return Section("Calibration", (*table, *sentences(told)))


def _calibration_row(name: str, channel: Channel, facts: Mapping[str, object], recording: Recording) -> tuple[str, ...]:
    gain = facts.get("gain_std")
    noise = "–" if channel.noise_std is None else f"{channel.noise_std:.3g} {unit_text(channel.unit)}"
    rest = "; ".join(f"{key}: {value}" for key, value in facts.items() if key != "gain_std")
    return (name, _device(channel.stream, recording), "not stated" if gain is None else f"{gain}", noise, rest or "–")


def _device(stream: str, recording: Recording) -> str:
    """What the device said it is, or the kind of its driver."""
    streams = recording.attributes.get("streams")
    own = streams.get(stream, {}) if isinstance(streams, Mapping) else {}
    return str(own.get("device_id") or own.get("source") or "–")


def configuration_section(campaign: Campaign) -> Section:
    """Both files, verbatim, as they were when the campaign was begun."""
    names = {"campaign_toml": "Campaign file", "bench_toml": "Bench file"}
    texts = [Verbatim(title, campaign.texts[key].strip()) for key, title in names.items() if campaign.texts.get(key)]
    devices = [f"{device}: {identity}" for device, identity in campaign.identities.items()]
    return Section("Configuration", (*sentences(devices), *texts), "" if texts else "Neither file is known.")


def versions_section(campaign: Campaign) -> Section:
    """Which program recorded, which computed, and by which bytes each recording is known again."""
    head = ("file", "thruster", "recorded by", "recording id", "SHA-256 of the file")
    rows = tuple(
        (
            run.path.name,
            run.thruster,
            str(run.recording.attributes.get("software", "")) if run.recording is not None else "",
            run.recording.recording_id if run.recording is not None else "",
            run.sha256,
        )
        for run in campaign.runs
    )
    table = Table("Recordings behind this page", head, rows, columns(head, *head))
    return Section("Versions and provenance", (table,), f"Computed by {pages.program()}.")


def signature_section() -> Section:
    """Room to sign on paper."""
    return Section("Signature", (Blanks(SIGNED),))
