"""The bench as its own process: ports, control, faults, the motor's own timeout, the truth."""

import os
import select
import shutil
import struct
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

from sim_devices.bench.process import ROOT, running

pytestmark = pytest.mark.alone  # a bench of its own process, in real time

WORLD = Path(__file__).parents[3] / "benches" / "simulated" / "world.toml"
PATIENCE = 10.0


@pytest.fixture
def bench(tmp_path):
    with running(WORLD, tmp_path / "ports", seed=1) as each:
        yield each


class Host:
    """A port as a program without any library sees it."""

    def __init__(self, path):
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self.got = b""

    def send(self, data):
        os.write(self.fd, data)

    def read_until(self, wanted, seconds=PATIENCE):
        """Everything up to and with the first `wanted`; what follows is kept."""
        deadline = time.monotonic() + seconds
        while wanted not in self.got:
            left = deadline - time.monotonic()
            assert left > 0, f"no {wanted!r} in {self.got[-200:]!r}"
            if select.select([self.fd], [], [], left)[0]:
                self.got += os.read(self.fd, 4096)
        head, _, self.got = self.got.partition(wanted)
        return head + wanted

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.fd)


def opened_bus(path):
    host = Host(path)
    host.send(b"C\rS6\rO\r")
    host.read_until(b"\r\r\r")
    return host


def drive(bus, volts):
    bus.send(b"T000000174" + struct.pack(">i", round(volts / 48.0 * 1e5)).hex().encode() + b"\r")
    bus.read_until(b"Z\r")


def wait_for(condition, what, seconds=PATIENCE):
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, f"waited {seconds} s for {what}"
        select.select([], [], [], 0.02)
    return found


def keep_driving(bus, volts, until):
    deadline = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < deadline
        drive(bus, volts)
        select.select([], [], [], 0.05)


def test_the_world_keeps_up_and_settles_at_its_truth(bench):
    with opened_bus(bench.links / "can0") as bus:
        keep_driving(bus, 10.0, lambda: '"rotation_rate": 9.99' in bench.tell("status"))
    states = bench.truth("state")
    assert states[-1]["t_ns"] <= time.monotonic_ns()
    turning = [s for s in states if s["n"] > 1.0]
    assert min(b["t_ns"] - a["t_ns"] for a, b in pairwise(turning)) >= 9_900_000
    assert turning[-1]["thrust"] == pytest.approx(0.412 * turning[-1]["n"] ** 2, rel=1e-5)


def test_the_motor_lets_go_by_itself_and_the_truth_says_when(bench):
    with opened_bus(bench.links / "can1") as bus:
        drive(bus, 6.0)
        (command,) = wait_for(lambda: bench.truth("command"), "the command in the truth log")
        assert command["volts"] == pytest.approx(6.0)
        (timeout,) = wait_for(lambda: bench.truth("timeout"), "the timeout in the truth log")
    assert (timeout["t_ns"] - command["t_ns"]) * 1e-9 == pytest.approx(0.5, abs=0.05)
    assert command["thruster"] == timeout["thruster"] == "T1"
    wait_for(lambda: bench.truth("state")[-1]["n"] < 0.5, "the rotor to stop")


def test_the_header_holds_the_true_constants(bench):
    (header,) = bench.truth("header")
    assert header["C"]["T3"] == 0.4306
    assert header["cell_gain"] == 1.0002


def test_weights_come_at_the_rate_asked_for(bench):
    with Host(bench.links / "load_cell") as host:
        host.send(b"@\r\nUPD 92\r\nSIR\r\n")
        host.read_until(b"UPD A\r\n")
        host.read_until(b"\n")
        begin = time.monotonic()
        lines = [host.read_until(b"\r\n") for _ in range(184)]
        assert time.monotonic() - begin == pytest.approx(2.0, abs=0.3)
    assert all(len(line) == 18 and line[:2] == b"S " and line.endswith(b" N\r\n") for line in lines)


def test_mounting_while_it_turns_is_refused_with_status_2(bench):
    words = [sys.executable, "-m", "sim_devices", "mount", str(bench.links / "control"), "T3"]
    with opened_bus(bench.links / "can0") as bus:
        keep_driving(bus, 5.0, lambda: bench.truth("state")[-1]["n"] > 4.0)
        with subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE, text=True) as refused:
            keep_driving(bus, 5.0, lambda: refused.poll() is not None)
            assert refused.stderr is not None
            said = refused.stderr.read()
    assert refused.returncode == 2
    assert "T1 turns at" in said
    wait_for(lambda: abs(bench.truth("state")[-1]["n"]) < 0.4, "the rotor to stop")
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert (done.returncode, done.stdout) == (0, "T3 is on the bench\n")
    assert bench.truth("mount")[-1]["thruster"] == "T3"


def test_mount_without_a_bench_says_so(tmp_path):
    words = [sys.executable, "-m", "sim_devices", "mount", str(tmp_path / "control"), "T3"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 2
    assert "no bench answers" in done.stderr


def test_faults_by_the_control_port(bench):
    assert bench.tell("fault load_cell overload") == "load_cell has fault overload"
    with Host(bench.links / "load_cell") as host:
        host.send(b"SI\r\n")
        host.read_until(b"S +\r\n")
        assert bench.tell("clear load_cell") == "load_cell is in order"
        host.send(b"SI\r\n")
        host.read_until(b" N\r\n")
        bench.tell("fault load_cell pulled")
        assert not (bench.links / "load_cell").is_symlink()
        wait_for(lambda: _gone(host), "the port to fail")
    bench.tell("clear load_cell")
    with Host(bench.links / "load_cell") as host:
        host.send(b"SI\r\n")
        host.read_until(b" N\r\n")
    assert [f["fault"] for f in bench.truth("fault")] == ["overload", "pulled"]
    bench.tell("fault can0 dropped 1.0")
    bench.tell("flow 0.4")
    with Host(bench.links / "flow") as host:
        wait_for(lambda: 0.35 < float(host.read_until(b"\r\n").split(b",")[5]) < 0.45, "the flow")


def _gone(host):
    try:
        host.send(b"SI\r\n")
    except OSError:
        return True
    return False


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("fault load_cell tired", "load_cell: expected one of frozen, .*pulled, dropped"),
        ("fault motor pulled", "motor: expected one of frozen"),
        ("fault loadcell frozen", "did you mean 'load_cell'"),
        ("flow fast", "could not convert"),
        ("mount T9", "unknown name 'T9'"),
        ("dance", "expected mount THRUSTER"),
    ],
)
def test_the_control_port_says_what_it_expected(bench, line, sentence):
    with pytest.raises(ValueError, match=sentence):
        bench.tell(line)


def test_scripted_faults_come_and_go(tmp_path):
    text = WORLD.read_text() + '[[faults]]\ndevice = "load_cell"\nfault = "overload"\nat = 0.2\nduration = 0.3\n'
    (tmp_path / "w.toml").write_text(text)
    with running(tmp_path / "w.toml", tmp_path / "ports") as bench:
        cleared = wait_for(lambda: bench.truth("clear"), "the end of the fault")
        (fault,) = bench.truth("fault")
    assert (cleared[0]["t_ns"] - fault["t_ns"]) * 1e-9 == pytest.approx(0.3, abs=0.05)


def test_links_are_removed_and_the_process_ends_in_order(tmp_path):
    with running(WORLD, tmp_path / "ports") as bench:
        names = {path.name for path in bench.links.iterdir() if path.is_symlink()}
        assert names == {"can0", "can1", "load_cell", "flow", "thermometer", "control"}
        bench.process.terminate()
        assert bench.process.wait(PATIENCE) == 0
    assert [path.name for path in (tmp_path / "ports").iterdir()] == ["truth.jsonl"]


HOLDS = """
import sys, time
from pathlib import Path
from sim_devices.bench.process import running

with running(Path(sys.argv[1]), Path(sys.argv[2])) as bench:
    print(bench.process.pid, flush=True)
    time.sleep(60.0)
"""


def test_a_bench_ends_with_the_process_that_started_it_killed_or_not(tmp_path):
    holds = [sys.executable, "-c", HOLDS, str(WORLD), str(tmp_path / "ports")]
    with subprocess.Popen(holds, cwd=ROOT, stdout=subprocess.PIPE, text=True) as holder:
        bench = int(holder.stdout.readline())
        words = Path(f"/proc/{bench}/cmdline")
        assert words.read_bytes()
        holder.kill()
    wait_for(lambda: not words.exists() or not words.read_bytes(), "the end of the bench")  # a zombie has none
    assert not [path for path in (tmp_path / "ports").iterdir() if path.is_symlink()]


def test_a_world_that_cannot_be_ends_with_status_2(tmp_path):
    (tmp_path / "w.toml").write_text("seeed = 1\n")
    with pytest.raises(RuntimeError, match="did you mean 'seed'"), running(tmp_path / "w.toml", tmp_path / "ports"):
        pass


def test_a_second_bench_on_the_same_links_is_refused(bench):
    with pytest.raises(RuntimeError, match="runs here already"), running(WORLD, bench.links):
        pass
    assert "T1" in bench.tell("status")


def test_a_cleaned_temporary_folder_does_not_let_a_second_bench_in(bench):
    shutil.rmtree((bench.links / "control").resolve().parent)
    with pytest.raises(RuntimeError, match="runs here already"), running(WORLD, bench.links):
        pass
    assert bench.truth("header")


def test_what_a_dead_host_left_unread_is_gone_when_the_next_one_opens(bench):
    serial = pytest.importorskip("serial")
    with Host(bench.links / "load_cell") as host:
        host.send(b"SIR\r\n")
        wait_for(lambda: '"load_cell": 0' not in bench.tell("status"), "the buffer to be full")
        host.send(b"@\r\n")
        begin = time.monotonic()
        wait_for(lambda: time.monotonic() > begin + 0.5, "the answer to be dropped")
    with serial.Serial(str(bench.links / "load_cell"), 38400, timeout=PATIENCE) as port:
        port.write(b"I4\r\n")
        assert port.readline() == b'I4 A "B021002593"\r\n'
