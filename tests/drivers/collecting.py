"""Golden frames, a peer that says nothing, and the rows that an instrument gives."""

from __future__ import annotations

from pathlib import Path

from tests.drivers.scripted_peer import wait_until

FOLDER = Path(__file__).parents[1] / "frames"


def quiet(peer, request):
    """Says nothing."""


def collect(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples
