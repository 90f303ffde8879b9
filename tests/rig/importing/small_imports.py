"""A few lines of text and a map of them, imported."""

from rig.hdf5 import load
from rig.importing.mapping import build_map, read_map
from rig.importing.one_file import import_file

PLAIN = {
    "about": "t",
    "time": {"column": "t"},
    "streams": {"s": {"channels": {"thrust": {"quantity": "thrust", "unit": "N", "column": "f"}}}},
}


def imported(tmp_path, text, plan, **overrides):
    source = tmp_path / "in.csv"
    source.write_bytes(text if isinstance(text, bytes) else text.encode())
    out = tmp_path / "out.h5"
    out.unlink(missing_ok=True)
    plan = read_map(plan) if isinstance(plan, str) else build_map(plan, "", "test")
    summary = import_file(source, plan, out, overrides)
    recording = load(out)
    assert recording.complete
    assert [event.text for event in recording.events] == list(summary.sentences)
    return summary, recording, {channel.name: channel for channel in recording.channels}


def plan(**changes):
    return {**PLAIN, **changes}


def values(channel):
    return channel.value.round(6).tolist()
