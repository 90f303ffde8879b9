"""Recordings in memory, and the real ones read straight from their files (mapping as measured on them)."""

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from identification.recording import Channel, Recording, Step

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "recordings"
LEVELS = (0.0, 6.0, -6.0, 12.0, -12.0, 0.0, 18.0, -18.0, 9.0, -9.0, 15.0, -15.0, 0.0)


def white(rng, n, runs=1):
    return rng.standard_normal((runs, n))


def ar1(phi):
    def draw(rng, n, runs=1):
        from scipy.signal import lfilter

        start = rng.standard_normal((runs, 1)) * phi
        out, _ = lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal((runs, n)), axis=1, zi=start)
        return out

    return draw


def flicker(low):
    """1/f down to 1 / (low n) per sample, flat below, so that its mean has a variance at all."""

    def draw(rng, n, runs=1):
        length = 16 * n
        frequency = np.fft.rfftfreq(length)
        gain = np.maximum(frequency, 1 / (low * n)) ** -0.5
        spectrum = (rng.standard_normal((runs, gain.size)) + 1j * rng.standard_normal((runs, gain.size))) * gain
        out = np.fft.irfft(spectrum, length)[:, :n]
        return out / np.sqrt(np.sum(gain**2) * 4) * length

    return draw


def staircase(
    C=0.4, C_minus=None, tare=1.5, noise=white, sigma=0.3, levels=LEVELS, hold=2.0, rate=50.0, rng=None, *,
    recording_id="run-1", thruster="T3", steps=True, dense=False, tau=0.0, calibration=None, mend=None,
):  # fmt: skip
    """Holds of C V|V| + tare, optional first-order settling `tau` s; `mend(t, V, F)` may change the thrust."""
    rng = rng or np.random.default_rng(0)
    n = round(hold * rate)
    t = np.arange(n * len(levels)) / rate
    V = np.repeat(np.array(levels), n)
    force = np.where(V > 0, C, C if C_minus is None else C_minus) * V * np.abs(V)
    if tau:
        from scipy.signal import lfilter

        a = np.exp(-1 / (tau * rate))
        force = lfilter([1 - a], [1, -a], force)
    F = force + tare + sigma * noise(rng, t.size)[0]
    if mend is not None:
        F = mend(t, V, F)
    edges = np.arange(len(levels)) * hold
    command = Channel("u", "command", "command_voltage", "V", edges, np.array(levels))
    if dense:
        dt = np.arange(int(t.size * 0.4)) / (0.4 * rate)
        command = Channel("u", "command", "command_voltage", "V", dt, np.repeat(np.array(levels), int(0.4 * n)))
    cell = Channel("f", "load_cell", "thrust", "N", t, F, calibration=calibration or {})
    table = tuple(
        Step(i, "rest" if v == 0 else "hold", v, float(s), float(s + hold))
        for i, (v, s) in enumerate(zip(levels, edges, strict=True))
    )
    return Recording(recording_id, thruster, (command, cell), steps=table if steps else ())


def sine(C=0.4, tare=1.5, noise=white, sigma=0.3, amplitude=18.0, period=20.0, cycles=4, rate=20.0, rng=None):
    rng = rng or np.random.default_rng(0)
    t = np.arange(int(period * cycles * rate)) / rate
    V = amplitude * np.sin(2 * np.pi * t / period)
    F = C * V * np.abs(V) + tare + sigma * noise(rng, t.size)[0]
    channels = (
        Channel("u", "motor", "motor_voltage", "V", t, V),
        Channel("f", "load_cell", "thrust", "N", t, F),
    )
    return Recording("sine-1", "T3", channels)


def _need(path: Path) -> Path:
    if not path.exists():
        pytest.skip(f"the real recordings are not here ({path.name}, see `origin` in rig/importing/maps)")
    return path


def voltage_sine_stand(number: int) -> Recording:
    """Force: lbf per raw x lever ratio x 4.4482216152605 N/lbf; leading zeros of the converter are not samples."""
    rows = []
    path = _need(SHARED / "voltage_sine_stand" / f"sensors_fixed_calibrated_test{number}.log")
    for line in path.read_text().splitlines():
        if line.startswith("#") or "<" in line:
            continue
        stamp, *raw = line.split("\t")
        when = datetime.strptime(f"{stamp.strip()} +0000", "%d-%b-%Y %H:%M:%S.%f %z")
        rows.append((when.timestamp(), *map(float, raw[:4])))
    table = np.array(rows)
    t = table[:, 0] - table[0, 0]
    force = table[:, 1] * 885.739990234375 * 0.6669999957084656 * 4.4482216152605
    force[: int(np.argmax(force != 0))] = np.nan
    channels = (
        Channel("voltage", "stand", "motor_voltage", "V", t, table[:, 4] * 23.533000946044922),
        Channel("thrust", "stand", "thrust", "N", t, force),
    )
    return Recording(f"sine-test{number}", "stand", channels)


def level_table(voltage, thrust, recording_id="levels") -> Recording:
    t = np.arange(len(voltage), dtype=float)
    channels = (
        Channel("u", "command", "command_voltage", "V", t, np.asarray(voltage, dtype=float)),
        Channel("f", "cell", "thrust", "N", t, np.asarray(thrust, dtype=float)),
    )
    return Recording(recording_id, "tank", channels)


def rov_levels() -> Recording:
    table = np.loadtxt(_need(SHARED / "rov_thruster_tank" / "Tach_RPM_Thrust_Data.csv"), delimiter=",")
    return level_table(table[:, 0], table[:, 4])


def t200_levels() -> Recording:
    table = np.loadtxt(_need(SHARED / "t200_18v_static" / "t200_18v_data.csv"), delimiter=",", skiprows=1)
    return level_table((table[:, 0] - 1500) / 400 * 18, table[:, 6])
