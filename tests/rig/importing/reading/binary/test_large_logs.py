"""A log with far more in it than a map asks for takes no more memory than what is asked for."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.rig.importing.reading.binary import logs
from tests.rig.importing.reading.binary.test_binary_logs import CASES, MAP

BALLAST = 96 * 2**20
"""Bytes of what nobody asks for."""
MOST = 40 * 2**20
"""Bytes that it may cost."""
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
IMPORT = """
import sys
from rig.cli import main
assert main(["import", *sys.argv[1:]]) == 0
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM:")))
"""
PICTURE = np.random.default_rng(0).integers(0, 256, 2**20, dtype=np.uint8)
ROWS = 100_000


def peak(folder: Path, name: str) -> int:
    """Bytes of memory at the most, of `rig import` as a process."""
    kind, message, time, volts, force = next(case[1:] for case in CASES if case[0] == name.partition(" ")[0])
    text = MAP.format(kind=kind, message=repr(message).replace("'", '"'), time=time, unit="s", volts=volts, force=force)
    (folder / "map.toml").write_text(text)
    words = [sys.executable, "-c", IMPORT, str(folder / "T1.log"), "--map", str(folder / "map.toml")]
    done = subprocess.run(words, stdout=subprocess.PIPE, env=ENVIRONMENT, check=True)
    return 1024 * int(done.stdout.split()[-1])


def wide(count: int) -> dict[str, np.ndarray]:
    """Columns of a table, `count` of them asked for by nobody."""
    columns = {name: np.interp(np.linspace(0, 19.9, ROWS), logs.TIME, values) for name, values in logs.COLUMNS.items()}
    return columns | {f"other_{i}": np.random.default_rng(i).normal(size=ROWS) for i in range(count)}


def parquet(path: Path, ballast: int) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(wide(ballast // (8 * ROWS))), path)


def tdms(path: Path, ballast: int) -> None:
    from nptdms import ChannelObject, TdmsWriter

    columns = wide(ballast // (8 * ROWS))
    with TdmsWriter(str(path)) as writer:
        for part in np.split(np.arange(ROWS), 10):
            writer.write_segment(
                [ChannelObject("run", name, x[part], {"wf_increment": 2e-4}) for name, x in columns.items()]
            )


def mdf(path: Path, ballast: int) -> None:
    from asammdf import MDF, Signal

    columns = wide(ballast // (8 * ROWS))
    with MDF(version="4.10") as file:
        for names in ([*logs.COLUMNS], [name for name in columns if name not in logs.COLUMNS]):
            signals = [Signal(columns[name], columns["t"], name=name, unit="V") for name in names]
            file.append(signals, acq_name="run" if "volts" in names else "others")
        file.save(path.with_suffix(".mf4"))
    path.with_suffix(".mf4").rename(path)


def mcap(path: Path, ballast: int) -> None:
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as out:
        writer = Writer(out, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema("run", "jsonschema", b"{}")
        camera = writer.register_channel("/camera", "raw", schema)
        topics = {name: writer.register_channel(f"/{name}", "json", schema) for name in ("drive", "cell")}
        for i, (t, volts, force) in enumerate(zip(logs.TIME, logs.VOLTS, logs.THRUST, strict=True)):
            stamp = round(t * 1e9)
            writer.add_message(topics["drive"], stamp, b'{"volts": %f}' % volts, stamp)
            writer.add_message(topics["cell"], stamp, b'{"wrench": {"force": [0, %f]}}' % force, stamp)
            if i < ballast // PICTURE.size:
                writer.add_message(camera, stamp, PICTURE.tobytes(), stamp)
        writer.finish()


def bag(path: Path, ballast: int) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    Float64, Bytes, Layout = (
        store.types[f"std_msgs/msg/{n}"] for n in ("Float64", "UInt8MultiArray", "MultiArrayLayout")
    )
    with Writer(path.with_suffix(".bag")) as writer:
        links = [writer.add_connection(f"/{n}", Float64.__msgtype__, typestore=store) for n in ("drive", "cell")]
        camera = writer.add_connection("/camera", Bytes.__msgtype__, typestore=store)
        picture = store.serialize_ros1(Bytes(Layout([], 0), PICTURE), Bytes.__msgtype__)
        for i, (t, *values) in enumerate(zip(logs.TIME, logs.VOLTS, logs.THRUST, strict=True)):
            for link, value in zip(links, values, strict=True):
                writer.write(link, round(t * 1e9), store.serialize_ros1(Float64(value), Float64.__msgtype__))
            if i < ballast // PICTURE.size:
                writer.write(camera, round(t * 1e9), picture)
    path.with_suffix(".bag").rename(path)


def ulog(path: Path, ballast: int) -> None:
    """Behind the run a topic of 4 kB a message."""
    with path.open("wb") as out:
        out.write(logs.ulog())
        for kind, content in ((b"F", b"camera:uint64_t timestamp;uint8_t[4096] row;"), (b"A", b"\0\x07\0camera")):
            out.write(struct.pack("<Hc", len(content), kind) + content)
        for i in range(ballast // 4096):
            content = struct.pack("<HQ", 7, 600_000 + i) + PICTURE[:4096].tobytes()
            out.write(struct.pack("<Hc", len(content), b"D") + content)


@pytest.mark.parametrize("make", [parquet, tdms, mdf, mcap, bag, ulog], ids=lambda make: make.__name__)
def test_what_nobody_asks_for_takes_no_memory(tmp_path, make):
    taken = []
    for ballast in (0, BALLAST):
        folder = tmp_path / str(ballast)
        folder.mkdir()
        make(folder / "T1.log", ballast)
        taken.append(peak(folder, make.__name__))
    assert (folder / "T1.log").stat().st_size > 0.9 * BALLAST
    assert taken[1] - taken[0] < MOST, [f"{bytes_ / 2**20:.0f} MiB" for bytes_ in taken]
