"""Which of 200 and more candidates would help, on 10^6 samples: our screening against refitting each candidate.

    python benchmarks/diagnosis/screening.py [SECONDS]        of one recording at 1 kHz, default 1000

Candidates are all trials of all terms of the catalogue (every channel recorded). The noise is estimated once and is the
same for all. Three ways to the same sigmas of each candidate:

- ours: samples are summed into some thousand intervals (one bincount), candidates are predicted there by linear
  filters, whitened together, C V|V| and tare are projected out, one product with the residual (Frisch and Waugh);
- projected: every candidate at every sample, whitened, projected and multiplied, one at a time;
- refitted: numpy.linalg.lstsq of C V|V|, tare and the candidate at every sample, whitened, one at a time.

The columns of the last two are those of the same terms, evaluated on an interval for each sample; making them is not in
their time.
Each is a process of its own, with one BLAS thread: CPU time, and peak memory above that with the recording loaded.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import process_time

import h5py
import numpy as np

from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model, extended
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.noise.covariance import Whitener
from identification.mismatch.prepare.grid import Held
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.mismatch.select.baseline import start
from identification.mismatch.select.forward_selection import available
from identification.mismatch.select.screening import directions
from identification.recording import Recording
from identification.run_history.filters import delayed
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun
from rig.hdf5 import load
from sim_devices import concealed

RATE = 1000.0
CHANNELS = ("rotation_rate", "current", "bus_voltage", "motor_temperature", "flow_speed")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
WAYS = ("ours", "projected", "refitted")
SLIGHT = 1e-4
"""s: for a slope over the shift of the clocks."""


def write_case(path: Path, seconds: float) -> None:
    rng = np.random.default_rng(5)
    case = concealed.case(
        rng, ["heating"], 40.0, noise="mixed", plan="interleaved", sampling=RATE, duration=seconds, channels=CHANNELS
    )
    (rows,) = concealed.rows(case)
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=1, recording_id=rows.recording_id)
        file.attrs.update(thruster=rows.thruster, complete=True, outcome="completed")
        for c in rows.columns:
            group = file.require_group(f"streams/{c.stream}")
            group["time"], group[c.name] = c.time, c.value
            group[c.name].attrs.update(quantity=c.quantity, unit=c.unit)


def prepared(recording: Recording) -> tuple[History, Data, Estimate]:
    """C V|V| and tare with the noise that they leave; the thrust is the only response."""
    history = history_of(recording)
    assert not isinstance(history, Refusal)
    data, theta = start([history])
    data = Data(data.histories, data.scale)
    return history, data, refresh(Model(), theta, data, None, None)


def ours(recording: Recording) -> tuple[list[str], list[float], float, int]:
    """Names, sigmas, CPU s, bytes at the peak."""
    _, data, estimate = prepared(recording)
    at_rest = peak()
    began = process_time()
    history = history_of(recording)
    assert not isinstance(history, Refusal)
    data = Data((history,), data.scale)
    found = directions(estimate.fit, data, estimate.weights, available(data))
    sigmas = found.columns.T @ estimate.fit.residual
    took = process_time() - began
    names = [f"{t.id} {t.form} {v}" for t, v in zip(found.terms, found.values, strict=True)]
    return names, sigmas.tolist(), took, peak() - at_rest


def by_samples(recording: Recording, *, refit: bool) -> tuple[list[str], list[float], float, int]:
    """Everything at every sample: the terms are evaluated on one interval per sample."""
    _, data, estimate = prepared(recording)
    sampled = replace(data, histories=(_each_sample(recording, data.histories[0]),))
    whitener, base, left = _at_samples(sampled, estimate)
    Q, _ = np.linalg.qr(base)
    names, sigmas, took, at_rest = [], [], 0.0, peak()
    for name, change in _candidates(sampled, estimate.fit.theta):
        began = process_time()
        column = whitener.whiten(change)
        rest = column - Q @ (Q.T @ column)
        size = float(np.linalg.norm(rest))
        sigma = float(rest @ left) / max(size, 1e-300)
        if refit:
            began = process_time()
            column = whitener.whiten(change)
            x = np.linalg.lstsq(np.column_stack([base, column]), left, rcond=None)[0]
            took += process_time() - began
            sigma = float(x[-1]) * size  # the coefficient over its standard error
        else:
            took += process_time() - began
        names.append(name)
        sigmas.append(sigma)
    return names, sigmas, took, peak() - at_rest


def _each_sample(recording: Recording, coarse: History) -> History:
    """An interval for every sample of the thrust; those that ours leaves out beside steps do not count here either."""
    command, thrust = recording.first_of("command_voltage"), recording.first_of("thrust")
    assert command is not None
    assert thrust is not None
    t = thrust.time
    edges = np.concatenate([[1.5 * t[0] - 0.5 * t[1]], 0.5 * (t[1:] + t[:-1]), [1.5 * t[-1] - 0.5 * t[-2]]])
    counts = np.isin(t, coarse.sample_time)
    return History(
        recording_id=coarse.recording_id,
        driver_quantity=coarse.driver_quantity,
        edges=edges,
        driver=Held(command, float(t[-1])).mean(edges),
        thrust=np.where(counts, thrust.value, np.nan),
        count=counts.astype(np.int64),
        sampled=t,
        within=np.zeros(t.size),
        others={k: np.interp(t, coarse.middle, v) for k, v in coarse.others.items()},
        rate_per_driver=coarse.rate_per_driver,
        spacing=coarse.spacing,
        tick=coarse.tick,
    )


def _at_samples(data: Data, estimate: Estimate) -> tuple[Whitener, np.ndarray, np.ndarray]:
    """Whitener, whitened columns of the baseline (C, tare and, where it is free, the shift of the clocks), residual."""
    (history,), theta = data.histories, estimate.fit.theta
    F, _ = predict(Model(), theta, data.runs[0], data.scale)
    later = [delayed(F, history.edges, theta.shift + more)[history.rows] for more in (0.0, SLIGHT)]
    whitener = Whitener(estimate.noise, data.thrust_rows[0], np.abs(later[0]))
    base = [later[0], np.ones(later[0].size)]
    if estimate.fit.free[estimate.fit.layout.shift]:
        base.append((later[1] - later[0]) / SLIGHT)
    left = history.thrust[history.rows] - later[0] - theta.tares[0]
    return whitener, whitener.whiten(np.column_stack(base)), whitener.whiten(left)


def _candidates(data: Data, theta: Theta) -> Iterator[tuple[str, np.ndarray]]:
    """Each trial's change of the thrust, at every sample."""
    model, (history,) = Model(), data.histories
    base, _ = predict(model, theta, data.runs[0], data.scale)
    for term in available(data):
        for trial in term.trials(data.scale):
            new, _ = predict(*extended(model, theta, term, trial), RememberedRun(history), data.scale)
            yield f"{term.id} {term.form} {trial}", (new - base)[history.rows]


def peak() -> int:
    return getrusage(RUSAGE_SELF).ru_maxrss * 1024


def one(way: str, path: Path) -> None:
    recording = load(path)
    names, sigmas, took, memory = ours(recording) if way == "ours" else by_samples(recording, refit=way == "refitted")
    print(json.dumps({"names": names, "sigmas": sigmas, "seconds": took, "memory": memory}))


def as_process(way: str, path: Path) -> dict[str, object]:
    done = subprocess.run(
        [sys.executable, __file__, way, str(path)],
        env={**os.environ, **ONE_THREAD},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.h5"
        write_case(path, seconds)
        print("| way | candidates | CPU s | of ours | peak MB | sigmas differ: median | at most | same 20 clearest |")
        print("|---|---|---|---|---|---|---|---|")
        found = {way: as_process(way, path) for way in WAYS}
        own = found["ours"]
        known = dict(zip(own["names"], own["sigmas"], strict=True))
        for way, other in found.items():
            theirs = dict(zip(other["names"], other["sigmas"], strict=True))
            both = [name for name in known if name in theirs]
            off = [abs(known[n] - theirs[n]) for n in both]
            clearest = [set(sorted(both, key=lambda n: -abs(s[n]))[:20]) for s in (known, theirs)]
            print(
                f"| {way} | {len(theirs)} | {other['seconds']:.2f} | {other['seconds'] / own['seconds']:.1f} "
                f"| {other['memory'] / 1e6:.0f} | {np.median(off):.3f} | {max(off):.2f} "
                f"| {len(clearest[0] & clearest[1])} of 20 |",
                flush=True,
            )


if __name__ == "__main__":
    if len(sys.argv) == 3:
        one(sys.argv[1], Path(sys.argv[2]))
    else:
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 1000.0)
