"""What a recorded row costs beside h5py itself: CPU time, appended and flushed, in turns.

    python benchmarks/recording.py [--batches 100 250 1000] [--turns 20]

A row is 17 numbers of 8 bytes, time and 16 channels; a batch is what one flush takes. Beside the recorder's file, which
has a dataset for each channel: one table of 17 columns, `resize` and a slice, as h5py's pages do it, with no name, unit
or order of its columns and no row looked at; and a dataset for each channel in the same way. All in SWMR mode, and each
flush is followed by an fsync. The median of the turns, and of the ratios within a turn.
"""

from __future__ import annotations

import argparse
import os
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


def cost(make: Callable[[Path], tuple[Append, Callable[[], object]]], path: Path, batch: int) -> tuple[float, float]:
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batches", type=int, nargs="+", default=[100, 250, 1000])
    parser.add_argument("--turns", type=int, default=20)
    asked = parser.parse_args()
    print("| rows in a batch | | appended, us a row | of table's | and flushed, us a row | of table's |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for batch in asked.batches:
            turns = [{k: cost(make, Path(name) / k, batch) for k, make in WRITERS.items()} for _ in range(asked.turns)]
            for which in WRITERS:
                own = np.array([turn[which] for turn in turns])
                ratio = np.median(own / np.array([turn["table"] for turn in turns]), axis=0)
                one, both = np.median(own, axis=0)
                print(f"| {batch} | {which} | {one:.3f} | {ratio[0]:.2f} | {both:.3f} | {ratio[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
