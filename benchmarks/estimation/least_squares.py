"""Least squares of 10^7 samples from an HDF5 file: ours in one pass, against numpy and statsmodels in memory.

    pip install -e '.[benchmark]'; python benchmarks/estimation/least_squares.py [SAMPLES]

Every row of the table is a process of its own: CPU time, and peak memory above that of the started process with the
file open. The peers get the data loaded into memory first; the loading is in their time and memory, as it is in ours.
Then a regressor of condition 1e10 whose parameters are known exactly. One BLAS thread.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import perf_counter, process_time

import h5py
import numpy as np

from identification.estimation.streaming import Block, stream_least_squares

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
BLOCK = 32_768
SAMPLE_BLOCKS = 64
SEED = 4


def columns(t: np.ndarray, p: int) -> np.ndarray:
    """A slow sine of voltage, its square, a tare; for more parameters harmonics and noise-like channels."""
    V = 12 * np.sin(2 * np.pi * t / 60) + 3 * np.sin(2 * np.pi * t / 7.3)
    basis = [V * np.abs(V), np.ones_like(V)]
    basis += [f(2 * np.pi * k * t / 11.0) for k in range(1, 6) for f in (np.sin, np.cos)]
    return np.column_stack(basis[:p])


def write_file(path: Path, n: int, p: int) -> None:
    rng = np.random.default_rng(SEED)
    theta = np.concatenate([[0.4, -2.0], 0.1 * np.arange(1, p - 1)])
    with h5py.File(path, "w") as file:
        H = file.create_dataset("H", (n, p), "f8", chunks=(BLOCK, p))
        y = file.create_dataset("y", (n,), "f8", chunks=(BLOCK,))
        for start in range(0, n, BLOCK):
            t = np.arange(start, min(n, start + BLOCK)) / 1000.0
            rows = columns(t, p)
            H[start : start + t.size] = rows
            y[start : start + t.size] = rows @ theta + rng.normal(size=t.size)


def write_ill(path: Path, n: int) -> None:
    """Two columns that differ by 2^-32 of integers: H, theta and y are exact, condition about 1e10."""
    rng = np.random.default_rng(SEED)
    a, b = rng.integers(-8, 9, n).astype(float), rng.integers(-8, 9, n).astype(float)
    H = np.column_stack([a, a + 2.0**-32 * b])
    with h5py.File(path, "w") as file:
        file["H"], file["y"] = H, H @ np.array([1.0, 2.0])


def blocks(file: h5py.File) -> Iterator[Block]:
    """Always in the same two arrays, by h5py's low-level read: new memory and slicing cost more than the bytes."""
    H, y = file["H"], file["y"]
    n, p = H.shape
    H_block, y_block = np.empty((BLOCK, p)), np.empty(BLOCK)
    H_space, y_space = H.id.get_space(), y.id.get_space()
    for start in range(0, n, BLOCK):
        k = min(BLOCK, n - start)
        H_space.select_hyperslab((start, 0), (k, p))
        H.id.read(h5py.h5s.create_simple((k, p)), H_space, H_block[:k])
        y_space.select_hyperslab((start,), (k,))
        y.id.read(h5py.h5s.create_simple((k,)), y_space, y_block[:k])
        yield H_block[:k], y_block[:k]


def spread_sample(file: h5py.File) -> Block:
    """Short runs of rows from all over the file."""
    n = len(file["y"])
    length = max(1, min(128, n // SAMPLE_BLOCKS))
    starts = np.linspace(0, n - length, SAMPLE_BLOCKS).astype(int)
    parts = [(file["H"][s : s + length], file["y"][s : s + length]) for s in starts]
    return np.vstack([H for H, _ in parts]), np.concatenate([y for _, y in parts])


def ours(file: h5py.File) -> np.ndarray:
    names = tuple(f"p{i}" for i in range(file["H"].shape[1]))
    return stream_least_squares(blocks(file), names, sample=spread_sample(file)).fit.theta


def reading(file: h5py.File) -> np.ndarray:
    return np.array([float(sum(y[0] for _, y in blocks(file)))])


def numpy_lstsq(file: h5py.File) -> np.ndarray:
    return np.linalg.lstsq(file["H"][:], file["y"][:], rcond=None)[0]


def statsmodels_ols(file: h5py.File) -> np.ndarray:
    from statsmodels.api import OLS

    return OLS(file["y"][:], file["H"][:]).fit().params


def normal_equations(file: h5py.File) -> np.ndarray:
    H, y = file["H"][:], file["y"][:]
    return np.linalg.solve(H.T @ H, H.T @ y)


WAYS = {f.__name__: f for f in (reading, ours, numpy_lstsq, statsmodels_ols, normal_equations)}


def one(way: str, path: Path) -> None:
    """Child process: prints its figures as JSON."""
    if way == "statsmodels_ols":
        import_module("statsmodels.api")
    with h5py.File(path, "r") as file:
        file["H"][:1], np.linalg.lstsq(np.eye(3), np.ones(3), rcond=None)
        before, cpu, wall = getrusage(RUSAGE_SELF).ru_maxrss, process_time(), perf_counter()
        theta = WAYS[way](file)
        cpu, wall = process_time() - cpu, perf_counter() - wall
        grown = getrusage(RUSAGE_SELF).ru_maxrss - before
    print(json.dumps({"theta": theta.tolist(), "cpu": cpu, "wall": wall, "MB": grown / 1024}))


def measure(way: str, path: Path) -> dict[str, object] | None:
    command = [sys.executable, __file__, "--one", way, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **ONE_THREAD}, check=False)
    if done.returncode:
        print(f"  {way}: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else 'killed (memory?)'}")
        return None
    found: dict[str, object] = json.loads(done.stdout)
    return found


def table(title: str, path: Path, ways: tuple[str, ...], n: int, exact: np.ndarray | None = None) -> None:
    print(f"\n{title}\n{'':20s}{'CPU s':>9s}{'ns/sample':>11s}{'extra MB':>10s}{'worst relative difference':>28s}")
    reference = exact
    for way in ways:
        found = measure(way, path)
        if found is None:
            continue
        theta = np.array(found["theta"])
        if reference is None and way == "numpy_lstsq":
            reference = theta
        far = "" if reference is None or way == "reading" else f"{np.abs(theta / reference - 1).max():.1e}"
        cpu = float(str(found["cpu"]))
        print(f"{way:20s}{cpu:9.2f}{1e9 * cpu / n:11.0f}{float(str(found['MB'])):10.1f}{far:>28s}")


def main(n: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.h5"
        for p in (2, 12):
            write_file(path, n, p)
            ways = ("reading", "numpy_lstsq", "ours", "statsmodels_ols")
            table(f"{n} samples, {p} parameters (difference from numpy_lstsq)", path, ways, n)
        write_ill(path, n // 10)
        ways = ("normal_equations", "numpy_lstsq", "statsmodels_ols", "ours")
        title = f"{n // 10} samples, 2 parameters, condition 1e10 (difference from the truth)"
        table(title, path, ways, n // 10, np.array([1.0, 2.0]))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], Path(sys.argv[3]))
    else:
        main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10**7)
