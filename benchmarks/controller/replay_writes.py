"""What a kill can leave of a recording, all of it: every write of a recorder replayed, and each cut at every page.

A kill stops the process between two writes, or the kernel within one, between two pages of memory. `strace` keeps the
writes of one recording from its first row to its closing; the file is then made anew up to each of them and read by
`load` and `recover`, ten seconds at most.

python benchmarks/controller/replay_writes.py [FLUSHES]
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rig.hdf5 import RecordingFile, load, recover
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec

PAGE = 4096
LIMIT = 10
"""s for one file."""
STREAMS = tuple(
    StreamSpec(name, "sim", (ChannelSpec("thrust", "thrust", "N"), ChannelSpec("raw", None, "1", integer=True)))
    for name in ("cell_a", "cell_b")
)
COLUMNS = 2 * len(STREAMS)
FILE = 3
"""The recording's descriptor: the first that the child opens after the standard ones."""
WRITE = re.compile(r'(pwrite64|write)\((\d+), "((?:\\x[0-9a-f]{2})*)", \d+(?:, (\d+))?\)')


def record(path: Path, flushes: int) -> None:
    """The child: says `flushed N` on its standard output whenever N rows are safe."""
    attributes = {"recording_id": "id", "thruster": "T1", "bench_toml": "b\n" * 900, "campaign_toml": "c\n" * 900}
    file = RecordingFile(path, attributes | {f"a{i}": "x" * 50 * i for i in range(12)}, STREAMS, 0)
    os.write(1, b"flushed 0")
    first = 0
    for number in range(flushes):
        index = np.arange(first, first + (20, 700, 60, 400)[number % 4])
        for stream in range(len(STREAMS)):
            file.add_rows(Rows(stream, index * 1_000_000, np.column_stack([index * 0.5, index]).astype(float)))
        file.add_event(EventRow(first, "info", f"event {first}"))
        file.add_step(StepRow(first, "hold", 1.0, first, first + 1))
        first += len(index)
        file.flush()
        os.write(1, b"flushed %d" % first)
    file.close("completed", "", 1.0)


def states(trace: Path) -> Iterator[tuple[str, bytes, int]]:
    """(what was done last, the file then, rows that are safe) from the first row on."""
    image, safe = bytearray(), -1
    for line in trace.read_text().splitlines():
        if not (found := WRITE.search(line)):
            continue
        data, at = bytes.fromhex(found[3].replace("\\x", "")), int(found[4] or 0)
        if found[2] == "1" and data.startswith(b"flushed "):
            safe = int(data[8:])
        if found[1] != "pwrite64" or int(found[2]) != FILE:
            continue
        image.extend(bytes(max(at - len(image), 0)))
        for cut in (*range((at // PAGE + 1) * PAGE - at, len(data), PAGE), len(data)):
            image[at : at + cut] = data[:cut]
            if safe >= 0:
                yield f"{cut} of {len(data)} bytes at {at}, {data[:4]!r}", bytes(image), safe


def check(path: Path, safe: int) -> None:
    recording = load(path)
    assert len(recording.channels) == COLUMNS, f"{len(recording.channels)} of {COLUMNS} channels"
    for channel in recording.channels:
        n = channel.value.size
        assert n >= safe, f"{n} of {safe} rows"
        assert np.array_equal(channel.value, np.arange(n) * (0.5 if channel.name == "thrust" else 1.0)), "wrong rows"
    if recording.attributes["opened_as"] != "plain":
        copy = path.with_name("copy.h5")
        copy.unlink(missing_ok=True)
        recover(path, copy)
        load(copy)


def passes(path: Path, safe: int, what: str) -> bool:
    """In a process of its own, which a hang ends by SIGALRM."""
    child = os.fork()
    if child == 0:
        signal.alarm(LIMIT)
        good = False
        try:
            check(path, safe)
            good = True
        finally:
            if not good:
                print(what, traceback.format_exc(limit=0).strip().splitlines()[-1], flush=True)
            os._exit(not good)
    status = os.waitpid(child, 0)[1]
    if os.WIFSIGNALED(status):
        print(f"{what}: nothing within {LIMIT} s", flush=True)
    return status == 0


def main(flushes: int) -> int:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace = folder / "trace"
        child = [sys.executable, __file__, str(flushes), str(folder / "written.h5")]
        strace = ["strace", "-f", "-xx", "-s", str(2**24), "-e", "trace=pwrite64,write", "-o", str(trace)]
        subprocess.run([*strace, *child], check=True, stdout=subprocess.DEVNULL)
        tried = bad = 0
        for what, image, safe in states(trace):
            path = folder / "try.h5"
            path.write_bytes(image)
            tried += 1
            bad += not passes(path, safe, what)
    print(f"{tried} files, {bad} that were not read whole")
    return 1 if bad or not tried else 0


if __name__ == "__main__":
    if len(sys.argv) > 2:
        record(Path(sys.argv[2]), int(sys.argv[1]))
    else:
        sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 12))
