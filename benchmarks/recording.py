"""What a recorded row costs beside h5py itself: CPU time, appended and flushed, in turns.

    python benchmarks/recording.py [--batches 100 250 1000] [--turns 20] [--tree OTHER]

A row is 17 numbers of 8 bytes, time and 16 channels; a batch is what one flush takes. Beside the recorder's file, which
has a dataset for each channel: one table of 17 columns, `resize` and a slice, as h5py's pages do it, with no name, unit
or order of its columns and no row looked at; and a dataset for each channel in the same way. All in SWMR mode, and each
flush is followed by an fsync. The median of the turns, and of the ratios within a turn. `--tree`: in every turn the
recorder's file of another checkout as well, in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import h5py
import numpy as np
from numpy.typing import NDArray

from rig.hdf5.layout import CHUNK_ROWS, LIBVER
from rig.hdf5.write import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec

CHANNELS = 16
ROWS = 50_000
"""Of each file."""
MS = 1_000_000
"""ns between rows."""


def durable(file: h5py.File) -> None:
    """As the recorder's flush: on the disk."""
    file.flush()
    os.fsync(file.id.get_vfd_handle())


Cost = tuple[float, float]
Append = Callable[[NDArray[np.int64], NDArray[np.float64]], None]


def recorder(path: Path) -> tuple[Append, Callable[[], object]]:
    channels = tuple(ChannelSpec(f"channel_{i}", None, "N") for i in range(CHANNELS))
    file = RecordingFile(path, {}, (StreamSpec("cell", "device", channels),), t0_ns=0)
    stream = file.streams[0]

    def append(t_ns: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        file.add_rows(Rows(0, t_ns, values))
        stream.write()

    return append, file.flush


def table(path: Path) -> tuple[Append, Callable[[], object]]:
    file = h5py.File(path, "x", libver=LIBVER)
    width = CHANNELS + 1
    rows = file.create_dataset("rows", (0, width), "f8", maxshape=(None, width), chunks=(CHUNK_ROWS, width))
    file.swmr_mode = True

    def append(t_ns: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        start = len(rows)
        rows.resize(start + len(t_ns), 0)
        rows[start:] = np.column_stack([t_ns * 1e-9, values])

    return append, lambda: durable(file)


def datasets(path: Path) -> tuple[Append, Callable[[], object]]:
    file = h5py.File(path, "x", libver=LIBVER)
    names = ("time", *(f"channel_{i}" for i in range(CHANNELS)))
    every = [file.create_dataset(name, (0,), "f8", maxshape=(None,), chunks=(CHUNK_ROWS,)) for name in names]
    file.swmr_mode = True

    def append(t_ns: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        for dataset, column in zip(every, (t_ns * 1e-9, *values.T), strict=True):
            start = len(dataset)
            dataset.resize(start + len(column), 0)
            dataset[start:] = column

    return append, lambda: durable(file)


WRITERS = {"table": table, "datasets": datasets, "recorder": recorder}


def cost(make: Callable[[Path], tuple[Append, Callable[[], object]]], path: Path, batch: int) -> Cost:
    """CPU us a row: appended; appended and flushed."""
    append, flush = make(path)
    values = np.random.default_rng(0).normal(size=(batch, CHANNELS))
    appended = flushed = 0.0
    for i in range(ROWS // batch):
        t_ns = np.arange(i * batch, (i + 1) * batch, dtype=np.int64) * MS
        begin = process_time()
        append(t_ns, values)
        middle = process_time()
        flush()
        appended += middle - begin
        flushed += process_time() - begin
    path.unlink()
    rows = ROWS // batch * batch
    return 1e6 * appended / rows, 1e6 * flushed / rows


def costs(folder: Path, batch: int, tree: Path | None) -> dict[str, Cost]:
    """Of one turn."""
    found = {name: cost(make, folder / name, batch) for name, make in WRITERS.items()}
    return found if tree is None else found | {"recorder of --tree": cost_there(folder / "there", batch, tree)}


def cost_there(path: Path, batch: int, tree: Path) -> Cost:
    """The recorder's, by the sources of another checkout."""
    asked = [sys.executable, __file__, "--batches", str(batch), "--only", str(path)]
    environment = os.environ | {"PYTHONPATH": str(tree)}
    told = subprocess.run(asked, env=environment, capture_output=True, text=True, check=True).stdout
    appended, flushed = json.loads(told)
    return appended, flushed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batches", type=int, nargs="+", default=[100, 250, 1000])
    parser.add_argument("--turns", type=int, default=20)
    parser.add_argument("--tree", type=Path)
    parser.add_argument("--only", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.only is not None:
        print(json.dumps(cost(recorder, asked.only, asked.batches[0])))
        return
    print("| rows in a batch | | appended, us a row | of table's | and flushed, us a row | of table's |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for batch in asked.batches:
            turns = [costs(Path(name), batch, asked.tree) for _ in range(asked.turns)]
            for which in turns[0]:
                own = np.array([turn[which] for turn in turns])
                ratio = np.median(own / np.array([turn["table"] for turn in turns]), axis=0)
                one, both = np.median(own, axis=0)
                print(f"| {batch} | {which} | {one:.3f} | {ratio[0]:.2f} | {both:.3f} | {ratio[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
