"""`rig capture` and `rig replay` against each simulated device: the rows of the run come again, to the bit."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.ports.transcript import Chunk, read_transcript
from drivers.vesc.uart_packets import framed
from rig.campaign.loading import load_bench
from rig.captures.capturing import Bound, by_driver, without_names, write
from rig.captures.description import Description
from rig.captures.description import write as describe
from rig.captures.playing import chunks_of, exact, play
from rig.cli import main
from rig.control.clocks import MonotonicClock
from rig.errors import ConfigError
from sim_devices.bench.process import RunningBench, running
from tests.rig.devices.test_devices_command import SERIAL, TELLING

BENCH = """
[bench]
name = "captured"
motor = "motor"
force = "load_cell"
max_voltage = 24.0
slew = 24.0
[devices.load_cell]
kind = "mt_sics"
port = "ports/load_cell"
baud = 38400
rate = 92.0
"""
OTHERS = """
[devices.motor]
kind = "roboteq"
port = "ports/motor"
nominal_bus_voltage = 48.0
watchdog_timeout = 1.0
rotation = "brushless"
pole_pairs = 7
[devices.flow]
kind = "nortek_nmea"
port = "ports/flow"
rate = 4.0
[devices.thermometer]
kind = "keller"
port = "ports/thermometer"
rate = 5.0
[devices.counts]
kind = "line_stream"
port = "ports/counts"
pattern = '(?P<raw>-?\\d+)'
rate = 80.0
line_characters = 11
scale = 0.001
[devices.laumas]
kind = "modbus_cell"
port = "ports/laumas"
map = "laumas"
rate = 10.0
unit = "kg"
decimals = 3
[devices.hbm]
kind = "hbm_aed"
port = "ports/hbm"
framing = "8N1"
rate = 25.0
top_rate = 100.0
nominal_force = 500.0
[devices.loadstar]
kind = "loadstar"
port = "ports/loadstar"
baud = 230400
rate = 575.0
[devices.card]
kind = "mantracourt_dsc"
port = "ports/card"
rate = 50.0
unit = "N"
[devices.meter]
kind = "pzem"
port = "ports/meter"
"""
BENCHES = Path(__file__).parents[3] / "benches"
FIRST_ROWS = 9
"""Of three streams, in which the voltage may not be known yet."""
VESC = """
[can.bus0]
interface = "slcan"
channel = "ports/can0"
[devices.motor]
kind = "vesc_can"
bus = "bus0"
vesc_id = 23
pole_pairs = 7
nominal_bus_voltage = 48.0
watchdog_timeout = 0.5
"""


def started(folder: Path, world: str, bench: str) -> Iterator[RunningBench]:
    (folder / "world.toml").write_text(world, encoding="utf-8")
    (folder / "bench.toml").write_text(bench, encoding="utf-8")
    with running(folder / "world.toml", folder / "ports") as made:
        yield made


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("captures")
    for _ in started(folder, SERIAL, BENCH + OTHERS):
        yield folder / "bench.toml"


@pytest.fixture(scope="module")
def vesc_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("captures_vesc")
    for _ in started(folder, TELLING, BENCH + VESC):
        yield folder / "bench.toml"


@pytest.mark.parametrize(
    "device",
    ["load_cell", "motor", "flow", "thermometer", "counts", "laumas", "hbm", "loadstar", "card", "meter", "VESC"],
)
def test_what_is_captured_is_played_to_the_bit(request, tmp_path, device):
    path = request.getfixturevalue("vesc_bench" if device == "VESC" else "bench")
    config, name = load_bench(path), "motor" if device == "VESC" else device
    file = tmp_path / "bytes.txt"
    taken = by_driver(config, name, file, Bound(0.8, 10**7), MonotonicClock())
    assert len(taken.rows) > 2
    options = config.devices[name].options
    describe(file, Description(config.devices[name].kind, name, bitrate=500_000, options=options))
    assert main(["replay", str(file), "--rows", str(tmp_path / "rows")]) == 0
    played = (tmp_path / "rows").read_text(encoding="ascii")
    live = exact(taken.rows).splitlines(keepends=True)
    if device == "motor":  # its two rounds of questions have no order among them
        assert set(live) <= set(played.splitlines(keepends=True))
    elif device == "VESC":  # the replay may begin with a frame more: it was written before the driver listened
        assert "".join(live[FIRST_ROWS:]) in played
    else:
        assert played.startswith("".join(live))


@pytest.mark.parametrize("name", ["odrive", "dronecan", "cia402"])
def test_a_motor_that_tells_its_state_by_itself_is_played(tmp_path, name):
    """Each on the bench that comes with it; messages of ten a second and of one, which the driver waits for."""
    made = BENCHES / name
    for _ in started(tmp_path, (made / "world.toml").read_text(), (made / "bench.toml").read_text()):
        config, file = load_bench(tmp_path / "bench.toml"), tmp_path / "bytes.txt"
        taken = by_driver(config, "motor", file, Bound(2.5, 10**7), MonotonicClock())
    options, bitrate = config.devices["motor"].options, config.can[config.devices["motor"].options.bus].bitrate
    describe(file, Description(config.devices["motor"].kind, "motor", bitrate=bitrate, options=options))
    assert main(["replay", str(file), "--rows", str(tmp_path / "rows")]) == 0
    live = exact(taken.rows).splitlines(keepends=True)
    assert "".join(live[len(live) // 3 :]) in (tmp_path / "rows").read_text(encoding="ascii")


def test_the_command_writes_bytes_and_description_and_drives_no_motor(bench, tmp_path, capsys):
    out = tmp_path / "motor.txt"
    assert main(["capture", str(bench), "motor", "-o", str(out), "--seconds", "0.5"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"\d+ bytes came and \d+ were sent in 0\.\d s\n\d+ rows of RCB500", said)
    sent = b"".join(chunk.data for chunk in read_transcript(out) if chunk.direction == ">")
    assert set(re.findall(rb"![^\r]*", sent)) == {b"!G 1 0"}
    assert 'kind = "roboteq"' in out.with_suffix(".toml").read_text(encoding="utf-8")
    assert "port" not in out.with_suffix(".toml").read_text(encoding="utf-8")
    assert main(["replay", str(out)]) == 0
    assert "motor: " in capsys.readouterr().out
    assert main(["capture", str(bench), "motor", "-o", str(out)]) == 2
    assert "exists and is not overwritten" in capsys.readouterr().err


def test_a_port_and_a_bus_that_are_only_listened_to(bench, vesc_bench, tmp_path, capsys):
    counts, bus = str(bench.parent / "ports" / "counts"), f"slcan:{vesc_bench.parent / 'ports' / 'can1'}@500000"
    words = ["--baud", "115200", "--seconds", "30", "--most-bytes", "2000", "--kind", "line_stream"]
    assert main(["capture", counts, "-o", str(tmp_path / "c.txt"), *words]) == 0
    assert "as large as it may be" in capsys.readouterr().out
    assert all(chunk.direction == "<" for chunk in read_transcript(tmp_path / "c.txt"))
    assert main(["replay", str(tmp_path / "c.txt")]) == 2
    assert "[options] is missing" in capsys.readouterr().err
    assert main(["capture", bus, "-o", str(tmp_path / "b.txt"), "--seconds", "0.4"]) == 0
    frames = [chunk.data for chunk in read_transcript(tmp_path / "b.txt")]
    assert any(frame.startswith(b"00000917#") for frame in frames)


def test_an_anonymised_capture_is_played_and_names_nobody(bench, tmp_path, capsys):
    out = tmp_path / "cell.txt"
    assert main(["capture", str(bench), "load_cell", "-o", str(out), "--seconds", "0.3", "--anonymise"]) == 0
    assert "B021002593" not in capsys.readouterr().out
    chunks = list(read_transcript(out))
    assert b"B021002593" not in b"".join(chunk.data for chunk in chunks)
    assert min(chunk.t_ns for chunk in chunks) == 0
    assert main(["replay", str(out)]) == 0
    assert "serial number B000000001" in capsys.readouterr().out


def test_what_cannot_be_anonymised_is_refused_and_nothing_is_kept(bench, tmp_path, capsys):
    out = tmp_path / "cell.txt"
    words = ["-o", str(out), "--seconds", "0.3", "--anonymise", "--baud", "9600"]
    port = str(bench.parent / "ports" / "counts")
    assert main(["capture", port, *words]) == 2
    assert "of a device of which nobody said the kind (--kind)" in capsys.readouterr().err
    assert main(["capture", port, *words, "--kind", "laumas"]) == 2
    assert "is no kind of device" in capsys.readouterr().err
    assert main(["capture", port, *words, "--kind", "keller"]) == 2
    assert "only listened to: any register may be a serial number" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["/dev/ttyX", "-o", "x.txt"], "give --baud (rig devices /dev/ttyX finds it)"),
        (["/dev/ttyX", "cell", "-o", "x.txt"], "/dev/ttyX is no bench file"),
        (["/dev/does_not_exist", "-o", "x.txt", "--baud", "9600"], "there is no such port"),
        (["/dev/ttyX", "-o", "x.toml", "--baud", "9600"], "the description of the capture has this ending"),
        (["/dev/ttyX", "-o", "x.txt", "--baud", "9600", "--framing", "x"], "framing must look like 8N1"),
        (["none.toml", "cell", "-o", "x.txt"], "there is no such bench file"),
    ],
)
def test_what_cannot_be_captured(tmp_path, monkeypatch, capsys, words, sentence):
    monkeypatch.chdir(tmp_path)
    assert main(["capture", *words]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_replayed(tmp_path, capsys):
    file = tmp_path / "bytes.txt"
    assert main(["replay", str(file)]) == 2
    assert "is no capture that can be read: No such file" in capsys.readouterr().err
    file.write_text("no capture\n")
    assert main(["replay", str(file)]) == 2
    assert "line 1: expected" in capsys.readouterr().err
    file.write_text("1 > 00\n")
    assert main(["replay", str(file)]) == 2
    assert "holds nothing that came from a device" in capsys.readouterr().err
    file.write_text("1 < 00\n")
    assert main(["replay", str(file)]) == 2
    assert "there is no such description of a capture" in capsys.readouterr().err
    (tmp_path / "bytes.toml").write_text('[capture]\nkind = "keller"\n[options]\n')
    assert main(["replay", str(file)]) == 2
    assert "the driver of kind keller does not open on this capture" in capsys.readouterr().err


def anonymous(kind: str, came: bytes, sent: bytes = b"", size: int = 7) -> bytes:
    """What came, in chunks that cut serial numbers in two."""
    chunks = [Chunk(0, ">", sent)] if sent else []
    chunks += [Chunk(at, "<", came[at : at + size]) for at in range(0, len(came), size)]
    return b"".join(chunk.data for chunk in without_names_of(kind, chunks) if chunk.direction == "<")


def without_names_of(kind: str, chunks: list[Chunk]) -> list[Chunk]:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        file = Path(folder) / "x"
        write(file, chunks)
        return without_names(file, kind)


def test_serial_numbers_are_replaced_consistently_and_checksums_are_good():
    text = b'I4 A "B021002593"\r\nS D     12.34 N\r\nI4 A "C7"\r\nI4 A "B021002593"\r\n'
    expected = b'I4 A "B000000001"\r\nS D     12.34 N\r\nI4 A "C2"\r\nI4 A "B000000001"\r\n'
    assert anonymous("mt_sics", text) == expected
    said = anonymous("nortek_nmea", b"$PNORI,4,Signature1000900001,4,20,0.20,1.00,0*1C\r\n")
    body, check = said.strip()[1:].split(b"*")
    assert b"900001" not in said
    value = 0
    for byte in body:
        value ^= byte
    assert int(check, 16) == value
    assert anonymous("roboteq", b"UID=12:345\rA=3\r") == b"UID=00:001\rA=3\r"
    assert anonymous("hbm_aed", b"0\r\nHBM,AD104C,0012345,P72\r\n") == b"0\r\nHBM,AD104C,0000001,P72\r\n"


def test_answers_that_do_not_say_to_what_are_told_by_their_questions():
    chunks = [
        Chunk(0, ">", b"!001:SERL?\r"), Chunk(1, "<", b"+123"), Chunk(2, "<", b"45.0\r"), Chunk(3, ">", b"!001:SYS?\r"),
        Chunk(4, "<", b"+12345.6\r"), Chunk(5, ">", b"!001:SERH?\r"), Chunk(6, "<", b"+00002.0\r"),
    ]  # fmt: skip
    said = b"".join(chunk.data for chunk in without_names_of("mantracourt_dsc", chunks) if chunk.direction == "<")
    assert said == b"+00001.0\r+12345.6\r+00002.0\r"
    chunks = [Chunk(0, ">", b"ID\r"), Chunk(1, "<", b"F1234\r\n"), Chunk(2, ">", b"W\r"), Chunk(3, "<", b"1234\r\n")]
    said = b"".join(chunk.data for chunk in without_names_of("loadstar", chunks) if chunk.direction == "<")
    assert said == b"F0001\r\n1234\r\n"
    chunks = [Chunk(0, ">", b"\x1bx2_\r\n"), Chunk(1, "<", b"          37454321  \r\n+   123.56 g  \r\n")]
    said = b"".join(chunk.data for chunk in without_names_of("sartorius_sbi", chunks) if chunk.direction == "<")
    assert said == b"          00000001  \r\n+   123.56 g  \r\n"
    chunks = [Chunk(0, ">", b"*IDN?\n"), Chunk(1, "<", b"Maker,PS-1,MY5500,1.2\n24.00\n")]
    said = b"".join(chunk.data for chunk in without_names_of("scpi_supply", chunks) if chunk.direction == "<")
    assert said == b"Maker,PS-1,MY0001,1.2\n24.00\n"


def test_the_uuid_of_a_vesc_on_uart_becomes_a_number_and_the_rest_is_as_it_was():
    uuid = bytes(range(1, 13))
    answer = framed(b"\0\x06\x05SIX\0" + uuid + b"\x01\x02")
    values = framed(bytes.fromhex("32 00 00 81 cf 013a 00fa 000004d2 00000237 00fc ffffe49c 01e1 02"))
    said = anonymous("vesc_uart", b"\x02\xff" + answer + values + answer)
    assert said == b"\x02\xff" + framed(b"\0\x06\x05SIX\0" + bytes(11) + b"\x01\x01\x02") + values + framed(
        b"\0\x06\x05SIX\0" + bytes(11) + b"\x01\x01\x02"
    )


def test_the_serial_number_of_a_canopen_device_becomes_a_number():
    said = without_names_of(
        "cia402",
        [
            Chunk(0, "<", b"585#43 18 10 04 78 56 34 12"), Chunk(1, "<", b"585#43 18 10 03 78 56 34 12"),
            Chunk(2, "<", b"185#37 02 00 00 00 00 00"), Chunk(3, "<", b"586#43 18 10 04 01 00 00 00"),
            Chunk(4, "<", b"585#43 18 10 04 78 56 34 12"),
        ],
    )  # fmt: skip
    assert [chunk.data for chunk in said] == [
        b"585#43 18 10 04 01 00 00 00", b"585#43 18 10 03 78 56 34 12", b"185#37 02 00 00 00 00 00",
        b"586#43 18 10 04 02 00 00 00", b"585#43 18 10 04 01 00 00 00",
    ]  # fmt: skip


def test_the_unique_id_of_a_dronecan_node_becomes_a_number_and_its_checksum_is_good():
    pytest.importorskip("dronecan", reason="dronecan is not installed (pip install -e .[dronecan])")
    from dronecan import uavcan
    from dronecan.transport import Transfer

    from drivers.dronecan.transfers import Assembler
    from drivers.ports.can_frame import Frame, frame_of

    told = uavcan.protocol.GetNodeInfo.Response(name="org.maker.esc")
    told.hardware_version.unique_id = list(range(100, 116))
    told.hardware_version.certificate_of_authenticity = [7, 8, 9]
    transfer = Transfer(
        payload=told, source_node_id=42, dest_node_id=10, transfer_id=3, transfer_priority=30,
        service_not_message=True, request_not_response=False,
    )  # fmt: skip
    frames = [Frame(each.message_id, True, bytes(each.bytes)) for each in transfer.to_frames()]
    chunks = [Chunk(at, "<", str(frame).encode()) for at, frame in enumerate(frames)]
    said = without_names_of("dronecan_esc", chunks)
    assembler = Assembler()
    whole = [assembler.feed(frame_of(chunk.data)) for chunk in said][-1]
    assert bytes(whole.value.hardware_version.unique_id) == bytes(15) + b"\x01"
    assert bytes(whole.value.hardware_version.certificate_of_authenticity) == bytes(3)
    assert bytes(whole.value.name) == b"org.maker.esc"
    assert [frame_of(chunk.data).id for chunk in said] == [frame.id for frame in frames]
    with pytest.raises(ConfigError, match="is not whole"):
        without_names_of("dronecan_esc", chunks[:-1])
    with pytest.raises(ConfigError, match="without an identifier"):
        without_names_of("dronecan_esc", [Chunk(0, "<", b"1E000100#00 00 00 00 00 00 00 C0")])


@pytest.mark.parametrize(
    ("kind", "came", "sent", "why"),
    [
        ("nortek_nmea", b"$PNORX,12345*00\r\n", b"", "what a PNORX says"),
        ("line_stream", b"\r\n12\r\nowner: Anna, 12\r\n13\r\n", b"", "may say more than a number"),
        ("modbus_cell", b"\x01\x03", b"\x01\x11\xc0\x2c", "is none of the rig's drivers"),
        ("vesc_can", b"00000517#00 01", b"", "which may hold the UUID"),
        ("modbus_registers", b"x", b"", "of a modbus_registers can't be anonymised"),
        ("odrive_can", b"066#00 01 02 03 04 05 06 00", b"", "may be Address, which may hold the serial number"),
        ("cia404", b"585#41 00 20 01 12 00 00 00", b"", "begins a text of the device"),
    ],
)
def test_what_may_name_somebody_is_refused(kind, came, sent, why):
    with pytest.raises(ConfigError, match=why):
        anonymous(kind, came, sent, size=100)


def test_a_driver_that_asks_otherwise_than_it_did_is_told(tmp_path):
    """Half of the questions of the transcript are others: the answers come all the same, and it is said."""
    capture = Path(__file__).parents[2] / "captures" / "laumas.txt"
    chunks = [
        chunk._replace(data=b"\x02" + chunk.data[1:]) if chunk.direction == ">" else chunk
        for chunk in chunks_of(capture)
    ]
    from rig.captures.description import read

    played = play(chunks, read(capture), lambda _: None)
    assert played.rows
    assert "the driver asked 01 03" in played.differences[0]
