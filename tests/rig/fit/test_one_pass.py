"""`rig.fit.one_pass`: the same numbers as a fit in memory, from files read once and in blocks."""

import json
import os
import signal
import sys
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from identification.recording import Channel
from identification.thruster.thrust_data import voltage_at
from rig.errors import RecordingError
from rig.fit import one_pass
from rig.fit.command import fit_command
from rig.fit.one_pass import fit_one_pass, thrust_rows
from rig.fit.one_pass_text import one_pass_json, one_pass_text
from rig.hdf5 import blocks, load

GAIN = '{"gain_std": 0.0005}'


def write(path: Path, streams, *, steps=(), thruster="T1", kind="tunnel", recording_id=None):
    """streams: name -> {channel: (quantity, unit, values)}, `time` among them."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, "thruster": thruster})
        file.attrs.update({"recording_id": recording_id or path.stem, "kind": kind})
        for name, columns in streams.items():
            for channel, (quantity, unit, values) in columns.items():
                item = file.create_dataset(f"streams/{name}/{channel}", data=values)
                item.attrs.update({"quantity": quantity, "unit": unit} if quantity else {})
                if quantity == "thrust":
                    item.attrs["calibration"] = GAIN
                if np.issubdtype(item.dtype, np.integer):
                    item.attrs["missing_value"] = -1
        if steps:
            kinds = [
                ("index", "<i4"),
                ("phase", "S8"),
                ("command_voltage", "<f8"),
                ("t_start", "<f8"),
                ("t_end", "<f8"),
            ]
            file["steps"] = np.array(steps, dtype=kinds)
    return path


def sine_run(path, seed=0, n=150_000, tare=1.5, rate=1000.0, **facts):
    """A cell at `rate`, a voltmeter on its own clock at a third of it; both with a few missing rows."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / rate
    tv = np.arange(n // 3 + 2) * 3 / rate - 0.0005
    V = 12 * np.sin(2 * np.pi * tv / 20) + 0.01 * rng.normal(size=tv.size)
    u = np.interp(t, tv, V)
    F = np.where(u > 0, 0.4, 0.35) * u * np.abs(u) + tare + 0.3 * rng.normal(size=n)
    V[rng.integers(0, tv.size, 40)] = np.nan
    F[rng.integers(0, n, 70)] = np.nan
    t[1000] = t[999] - 1.0
    streams = {
        "motor": {"time": (None, None, tv), "u": ("motor_voltage", "V", V)},
        "cell": {"time": (None, None, t), "F": ("thrust", "N", F)},
    }
    return write(path, streams, **facts)


def in_memory(path, split):
    recording = load(path)
    thrust, source = recording.first_of("thrust"), recording.first_of("motor_voltage")
    V = voltage_at(source, thrust.time)
    good = np.isfinite(V) & np.isfinite(thrust.value)
    q = V[good] * np.abs(V[good])
    columns = [np.maximum(q, 0), np.minimum(q, 0)] if split else [q]
    return np.column_stack(columns), thrust.value[good]


@pytest.mark.parametrize(("model", "names"), [("C V|V|", ("C",)), ("C+/C-", ("C_plus", "C_minus"))])
def test_several_files_agree_with_memory(tmp_path, model, names):
    paths = [sine_run(tmp_path / "a.h5", 1), sine_run(tmp_path / "b.h5", 2, 70_001, tare=-3.0)]
    assert thrust_rows(paths) == 220_001
    (found,) = fit_one_pass(paths, model)
    parts = [in_memory(path, model != "C V|V|") for path in paths]
    H = np.zeros((sum(len(y) for _, y in parts), len(names) + 2))
    H[:, : len(names)] = np.vstack([part for part, _ in parts])
    H[: len(parts[0][1]), -2] = H[len(parts[0][1]) :, -1] = 1.0
    y = np.concatenate([y for _, y in parts])
    theta, square, _, values = np.linalg.lstsq(H, y, rcond=None)
    assert found.rows == len(y)
    assert [p.value for p in found.parameters.values()] == pytest.approx(theta[: len(names)], rel=1e-9)
    assert tuple(found.parameters) == names
    assert [p.value for p in found.tare.values()] == pytest.approx(theta[len(names) :], rel=1e-9)
    assert found.rmse == pytest.approx(np.sqrt(square[0] / len(y)), rel=1e-9)
    assert found.fit.singular_values == pytest.approx(values, rel=1e-9)
    C = next(iter(found.parameters.values()))
    assert C.std_calibration == pytest.approx(0.0005 * C.value)


@pytest.mark.parametrize("n", [900, 2000, 8191, 8193])
def test_short_recordings_agree_with_memory(tmp_path, n):
    """The sample of a short one may have none of its rows twice."""
    t = np.arange(n) / 100
    rng = np.random.default_rng(n)
    u = 12 * np.sin(t)
    streams = {
        "motor": {"time": (None, None, t), "u": ("motor_voltage", "V", u)},
        "cell": {"time": (None, None, t), "F": ("thrust", "N", 0.4 * u * np.abs(u) + 0.3 * rng.normal(size=n))},
    }
    path = write(tmp_path / "a.h5", streams)
    (found,) = fit_one_pass([path])
    H, y = in_memory(path, split=False)
    theta = np.linalg.lstsq(np.column_stack([H, np.ones(len(y))]), y, rcond=None)[0]
    assert found.rows == len(y)
    assert found.parameters["C"].value == pytest.approx(theta[0], rel=1e-9)


def noise(rng, n, memory):
    from scipy.signal import lfilter

    a = np.exp(-1.0 / memory)
    return lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(size=n + 10 * memory))[10 * memory :]


def holds_run(path, memory=200, levels=(0.0, 6.0, -6.0, 12.0, -12.0, 0.0) * 4, hold=4.0, rate=500.0, lag=0.4):
    from scipy.signal import lfilter

    rng = np.random.default_rng(5)
    n = int(hold * rate)
    V = np.repeat(levels, n)
    a = np.exp(-1 / (lag * rate))
    F = lfilter([1 - a], [1, -a], 0.4 * V * np.abs(V)) + 1.5 + 0.3 * noise(rng, V.size, memory)
    starts = np.arange(len(levels)) * hold
    streams = {
        "command": {"time": (None, None, starts), "u": ("command_voltage", "V", np.array(levels))},
        "cell": {"time": (None, None, np.arange(V.size) / rate), "F": ("thrust", "N", F)},
    }
    steps = [(i, b"hold", v, s, s + hold) for i, (v, s) in enumerate(zip(levels, starts, strict=True))]
    return write(path, streams, steps=steps)


def test_of_holds_the_settled_half_and_correlation_paid_for(tmp_path):
    (found,) = fit_one_pass([holds_run(tmp_path / "holds.h5")])
    C = found.parameters["C"]
    assert found.rows == 24 * 1000
    assert C.value == pytest.approx(0.4, abs=4 * C.std + 0.4 * np.exp(-2 / 0.4))
    assert C.std_statistical > 5 * C.std_internal
    assert not found.spread.slow
    text = one_pass_text(found)
    assert "last 50 % were used" in text
    assert "taken as uncorrelated" in text
    assert "thrust = C V|V| + tare" in text


def test_noise_slower_than_the_batches_is_said(tmp_path):
    (found,) = fit_one_pass([holds_run(tmp_path / "slow.h5", memory=6000)])
    assert found.spread.slow
    assert "standard errors are too small" in one_pass_text(found)


def test_json_is_finite_and_says_what_was_left_out(tmp_path):
    (found,) = fit_one_pass([sine_run(tmp_path / "a.h5", n=20_000)])
    (content,) = one_pass_json([found])["fits"]
    assert content["parameters"]["C"]["value"] == found.parameters["C"].value
    assert content["skipped_samples"] > 70
    assert "explained by motor_voltage, not by the command" in content["verdicts"]
    assert np.isfinite(content["sigma"])


def test_the_command_in_one_pass(tmp_path):
    sine_run(tmp_path / "a.h5", n=20_000)
    said = CliRunner().invoke(fit_command, [str(tmp_path), "--one-pass", "--json", str(tmp_path / "fit.json")])
    assert said.exit_code == 0
    assert "samples read in one pass" in said.output
    assert json.loads((tmp_path / "fit.json").read_text())["fits"][0]["one_pass"]["batches"] > 30
    for more in (["--report", "page.html"], ["--compare", "old.json"], ["--model", "dynamics"], ["--method", "ls"]):
        refused = CliRunner().invoke(fit_command, [str(tmp_path), "--one-pass", *more])
        assert refused.exit_code == 2
        assert f"{more[0]} {more[1] if more[0] == '--model' else ''}".strip() in refused.output


def test_counts_by_rate_with_missing_rows(tmp_path):
    t = np.arange(5000) / 100
    n = np.round(20 * np.sin(t)).astype(np.int64)
    F = 0.05 * n * np.abs(n) - 1.0 + 0.01 * np.random.default_rng(0).normal(size=t.size)
    n[n == -1] = -2
    n[77] = -1
    F[n == -2] = np.nan
    streams = {
        "motor": {"time": (None, None, t), "n": ("rotation_rate", "rev/s", n)},
        "cell": {"time": (None, None, t), "F": ("thrust", "N", F)},
    }
    (found,) = fit_one_pass([write(tmp_path / "n.h5", streams)])
    assert found.parameters["C_t"].value == pytest.approx(0.05, rel=1e-3)
    assert "explained by rotation_rate" in one_pass_text(found)


def test_memory_does_not_grow_with_the_recording(tmp_path, monkeypatch):
    """Of the reading itself, which is done in a child otherwise, where tracemalloc does not look."""
    monkeypatch.setattr(one_pass, "apart", lambda work, path: work())
    monkeypatch.setattr(one_pass, "open_no_more", lambda: None)
    peaks = []
    for n in (400_000, 1_600_000):
        path = sine_run(tmp_path / f"{n}.h5", n=n)
        tracemalloc.start()
        fit_one_pass([path])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0] < 12e6


@pytest.mark.skipif(sys.platform != "linux", reason="read in the process itself elsewhere: docs/decisions/0014")
def test_what_ends_hdf5_does_not_end_the_command(tmp_path, monkeypatch):
    path = sine_run(tmp_path / "a.h5", n=3000)

    def dies(*_):
        os.kill(os.getpid(), signal.SIGSEGV)

    monkeypatch.setattr(one_pass, "_sample", dies)
    with pytest.raises(RecordingError, match=r"a\.h5 is damaged, or was made to harm: HDF5 ended with SIGSEGV"):
        fit_one_pass([path])


def test_a_piece_of_a_channel_says_the_same_as_all_of_it(tmp_path):
    path = sine_run(tmp_path / "a.h5", n=3000)
    whole = load(path).first_of("motor_voltage")
    with blocks.long_channels(path, whole) as (found,):
        for first, last in ((0.0, 0.5), (0.7, 0.71), (2.9, 2.999), (2.9, 9.0)):
            times = np.linspace(first, last, 400)
            piece, start = found.around(first, last, max(found.place(first) - 2, 0))
            assert voltage_at(piece, times) == pytest.approx(voltage_at(whole, times), nan_ok=True)
            assert start <= found.place(first)


T = np.arange(0.0, 10.0, 0.01)
CELL = {"time": (None, None, T), "F": ("thrust", "N", T)}
ONE = {"time": (None, None, T[:1]), "u": ("command_voltage", "V", np.array([5.0]))}
EMPTY = {"time": (None, None, T[:1]), "u": ("command_voltage", "V", np.array([np.nan]))}
SHORT = {name: (*facts, values[:60]) for name, (*facts, values) in CELL.items()}
SHORT_VOLTAGE = {"time": (None, None, T[:60]), "u": ("motor_voltage", "V", np.sin(T[:60]))}
LATE = {"time": (None, None, T[:2] + 99), "u": ("command_voltage", "V", np.array([5.0, 6.0]))}


@pytest.mark.parametrize(
    ("streams", "facts", "message"),
    [
        ({"cell": CELL, "command": ONE}, {"kind": "vehicle"}, "vehicle trial"),
        ({"command": ONE}, {}, "no channel of quantity thrust"),
        ({"cell": CELL}, {}, "no command_voltage nor"),
        ({"cell": CELL, "command": EMPTY}, {}, "no command_voltage nor"),
        ({"cell": CELL, "command": ONE}, {}, "cannot tell the combination"),
        ({"cell": CELL, "command": LATE}, {}, "no thrust sample at a known"),
    ],
)
def test_what_cannot_be_fitted_is_told(tmp_path, streams, facts, message):
    with pytest.raises(RecordingError, match=message):
        fit_one_pass([write(tmp_path / "a.h5", streams, **facts)])


def test_the_same_recording_twice_and_kinds_that_do_not_mix(tmp_path):
    one = sine_run(tmp_path / "a.h5", n=5000)
    with pytest.raises(RecordingError, match="same recording"):
        fit_one_pass([one, sine_run(tmp_path / "b.h5", n=5000, recording_id="a")])
    rate = {"time": (None, None, T), "n": ("rotation_rate", "rev/s", 20 * np.sin(T))}
    other = write(tmp_path / "c.h5", {"cell": CELL, "motor": rate})
    with pytest.raises(RecordingError, match="only a rotation rate"):
        fit_one_pass([one, other])
    with pytest.raises(RecordingError, match="flow term"):
        fit_one_pass([one], "C V|V| - C_s|V|U")
    with pytest.raises(RecordingError, match="too few samples"):
        fit_one_pass([write(tmp_path / "d.h5", {"cell": SHORT, "motor": SHORT_VOLTAGE})])


def test_a_channel_that_is_not_in_the_file(tmp_path):
    path = sine_run(tmp_path / "a.h5", n=5000)
    other = Channel("x", "cell", None, "1", T, T)
    with pytest.raises(RecordingError, match="no channel cell/x"), blocks.long_channels(path, other):
        pass
