"""The same run as every kind of log, written by the format's own library or, where it has no writer, by its
specification."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path

import numpy as np

TIME = np.arange(0.0, 20.0, 0.1)
VOLTS = np.where(TIME % 8 < 4, 6.0, -3.0)
THRUST = 0.3 * VOLTS * np.abs(VOLTS) + 0.01 * np.sin(TIME)
COLUMNS = {"t": TIME, "volts": VOLTS, "force": THRUST}
EPOCH = 1_760_000_000


def parquet() -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    out = io.BytesIO()
    pq.write_table(pa.table({**COLUMNS, "note": ["text"] * TIME.size}), out)
    return out.getvalue()


def mat() -> bytes:
    from scipy.io import savemat

    out = io.BytesIO()
    savemat(out, {"run": COLUMNS, "comment": "tunnel", "matrix": np.column_stack([TIME, VOLTS, THRUST])})
    return out.getvalue()


def mat_7_3() -> bytes:
    """MATLAB writes 512 bytes of its own before the HDF5, and a vector as a row of what is a column there."""
    import h5py

    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512) as file:
        for name, values in COLUMNS.items():
            file[f"run/{name}"] = values[None, :]
    data = bytearray(out.getvalue())
    data[:19] = b"MATLAB 7.3 MAT-file"
    return bytes(data)


def tdms() -> bytes:
    from nptdms import ChannelObject, TdmsWriter

    out = io.BytesIO()
    waveform = {"wf_increment": 0.1, "wf_start_offset": 0.0, "unit_string": "N"}
    with TdmsWriter(out) as writer:
        for part in np.split(np.arange(TIME.size), 10):
            fast = [ChannelObject("run", name, x[part], waveform) for name, x in (("volts", VOLTS), ("force", THRUST))]
            slow = ChannelObject("slow", "supply", VOLTS[part[::10]], {"wf_increment": 1.0})
            writer.write_segment([*fast, slow])
    return out.getvalue()


def mdf() -> bytes:
    from asammdf import MDF, Signal

    out = io.BytesIO()
    with MDF(version="4.10") as file:
        signals = [Signal(values, TIME, name=name, unit="V") for name, values in (("volts", VOLTS), ("force", THRUST))]
        file.append(signals, acq_name="run")
        file.save(out)
    return out.getvalue()


def mcap() -> bytes:
    from mcap.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("run", "jsonschema", b"{}")
    topics = {name: writer.register_channel(f"/{name}", "json", schema) for name in ("drive", "cell")}
    for t, volts, force in zip(TIME, VOLTS, THRUST, strict=True):
        for name, value in (("drive", {"volts": volts}), ("cell", {"wrench": {"force": [0.0, force]}})):
            stamp = round(t * 1e9) + (name == "cell") * 20_000_000
            writer.add_message(topics[name], stamp, json.dumps(value).encode(), stamp)
    writer.finish()
    return out.getvalue()


def _ros(path: Path, writer, typestore) -> None:
    """Float64 and WrenchStamped, as thrusters and load cells have them."""
    Float64 = typestore.types["std_msgs/msg/Float64"]
    serialize = typestore.serialize_ros1 if path.suffix == ".bag" else typestore.serialize_cdr
    with writer as bag:
        links = [bag.add_connection(f"/{name}", Float64.__msgtype__, typestore=typestore) for name in ("drive", "cell")]
        for t, volts, force in zip(TIME, VOLTS, THRUST, strict=True):
            for link, value in zip(links, (volts, force), strict=True):
                bag.write(link, round(t * 1e9), serialize(Float64(value), Float64.__msgtype__))


def bag(folder: Path) -> bytes:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    path = folder / "run.bag"
    _ros(path, Writer(path), get_typestore(Stores.ROS1_NOETIC))
    return path.read_bytes()


def mcap_ros2(folder: Path) -> bytes:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    path = folder / "bag"
    _ros(path, Writer(path, version=9, storage_plugin=StoragePlugin.MCAP), get_typestore(Stores.ROS2_HUMBLE))
    return next(path.glob("*.mcap")).read_bytes()


def ulog(second: str = "cell") -> bytes:
    """By PX4's ULog File Format: header, flag bits, formats, subscriptions, data."""

    def message(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message(b"B", bytes(40))]
    out += [message(b"F", b"actuator_motors:uint64_t timestamp;float[2] control;")]
    fields = "float force;" if second == "cell" else "float vx;float vy;"
    out += [message(b"F", f"{second}:uint64_t timestamp;{fields}".encode())]
    topics = (b"actuator_motors", second.encode())
    out += [message(b"A", struct.pack("<BH", 0, i) + name) for i, name in enumerate(topics)]
    for t, volts, force in zip(TIME, VOLTS, THRUST, strict=True):
        stamp = round(t * 1e6) + 500_000
        out.append(message(b"D", struct.pack("<HQff", 0, stamp, volts / 16.0, 0.0)))
        values = (force,) if second == "cell" else (0.6 * force, 0.8 * force)
        out.append(message(b"D", struct.pack(f"<HQ{len(values)}f", 1, stamp + 20_000, *values)))
    return b"".join(out)


HEAD = b"\xa3\x95"


def layout(kind: int, size: int, name: bytes, format_: bytes, labels: bytes) -> bytes:
    """By ArduPilot's LogStructure.h: FMT messages say how the others are laid out."""
    return HEAD + struct.pack("<BBB4s16s64s", 128, kind, size, name, format_, labels)


def dive() -> bytes:
    """Vertical motors that turn against each other, a depth that grows, and attitude."""
    out = [
        layout(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"),
        layout(1, 23, b"RCOU", b"QHHHHHH", b"TimeUS,C1,C2,C3,C4,C5,C6"),
        layout(2, 15, b"CTUN", b"Qf", b"TimeUS,Alt"),
        layout(3, 19, b"ATT", b"Qff", b"TimeUS,Roll,Pitch"),
    ]
    for t, volts in zip(TIME, VOLTS, strict=True):
        stamp, pulse = round(t * 1e6), round(25 * volts)
        out.append(HEAD + struct.pack("<BQ6H", 1, stamp, *[1500] * 4, 1500 + pulse, 1500 - pulse))
        out.append(HEAD + struct.pack("<BQf", 2, stamp + 10_000, -0.05 * t))
        out.append(HEAD + struct.pack("<BQff", 3, stamp + 20_000, 1.0, -2.0))
    return b"".join(out)


def vrx() -> bytes:
    """Topics of VRX, as JSON."""
    from mcap.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("any", "jsonschema", b"{}")
    truth = "/wamv/sensors/position/ground_truth_odometry"
    names = ("/wamv/thrusters/left/thrust", "/wamv/thrusters/right/thrust", truth)
    topics = {name: writer.register_channel(name, "json", schema) for name in names}
    for t, volts in zip(TIME, VOLTS, strict=True):
        for name in names:
            message = {"twist": {"twist": {"linear": {"x": 0.1 * t}}}} if name == truth else {"data": 10 * volts}
            writer.add_message(topics[name], round(t * 1e9), json.dumps(message).encode(), round(t * 1e9))
    writer.finish()
    return out.getvalue()


def dataflash() -> bytes:
    """Two messages."""
    out = [
        layout(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"),
        layout(1, 15, b"RCOU", b"QHH", b"TimeUS,C1,C2"),
        layout(2, 15, b"CELL", b"Qf", b"TimeUS,F"),
    ]
    for t, volts, force in zip(TIME, VOLTS, THRUST, strict=True):
        stamp = round(t * 1e6)
        out.append(HEAD + struct.pack("<BQHH", 1, stamp, round(1500 + 25 * volts), 1500))
        out.append(HEAD + struct.pack("<BQf", 2, stamp + 20_000, force))
    return b"".join(out)


def tlog() -> bytes:
    """Each message behind the time of its arrival in us, as MAVProxy and QGroundControl write it."""
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    link, out = mavlink.MAVLink(None, srcSystem=1), []
    for t, volts in zip(TIME, VOLTS, strict=True):
        pulses = [round(1500 + 25 * volts), *[1500] * 7]
        for message in (
            link.servo_output_raw_encode(round(t * 1e6), 0, *pulses),
            link.scaled_pressure2_encode(round(t * 1e3), 1013.0 + t, 0.0, 1500),
        ):
            out.append(struct.pack(">Q", round((EPOCH + t) * 1e6)) + message.pack(link))
    return b"".join(out)
