"""`rig jog` on a simulated bench, as an operator has it: a key that repeats, let go, hung up, killed."""

from __future__ import annotations

import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.cli import main
from sim_devices.bench.process import RunningBench, running
from tests.rig.console.terminal import Terminal, on_terminal

BENCHES = Path(__file__).parents[3] / "benches"
CALL = "import sys; from rig.cli import main; sys.exit(main())"
PATIENCE = 20.0


def files(folder: Path, which: str) -> Path:
    """The bench without its crane."""
    shutil.copy(BENCHES / which / "world.toml", folder)
    text = (BENCHES / which / "bench.toml").read_text(encoding="utf-8")
    (folder / "bench.toml").write_text(text[: text.index("[mount]")], encoding="utf-8")
    return folder / "bench.toml"


@contextmanager
def held(terminal: Terminal) -> Iterator[Callable[[], None]]:
    """SPACE as a terminal repeats it, until the block is left or what it gives is called."""
    up = threading.Event()

    def press() -> None:
        while not up.wait(0.03):
            terminal.press(b" ")

    thread = threading.Thread(target=press)
    thread.start()

    def let_go() -> None:
        up.set()
        thread.join()

    try:
        yield let_go
    finally:
        let_go()


def volts(bench: RunningBench) -> list[tuple[float, float]]:
    """(s, V) of each change of what the motor was commanded."""
    return [(line["t_ns"] * 1e-9, line["volts"]) for line in bench.truth() if line["event"] in ("command", "timeout")]


def wait_for(condition) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@contextmanager
def jogging(tmp_path: Path):
    """A jog of 3 V that is held: (bench, process, terminal, what lets go)."""
    bench_file = files(tmp_path, "roboteq")
    with (
        running(tmp_path / "world.toml", tmp_path / "ports") as bench,
        on_terminal(
            CALL.replace("main()", "main(sys.argv[1:])"), "jog", str(bench_file), "3", "--output", str(tmp_path / "out")
        ) as (process, terminal),
    ):
        terminal.until(b"THE PROPELLER TURNS WHILE YOU HOLD SPACE")
        assert all(v == 0.0 for _, v in volts(bench)), "nothing before the key"
        with held(terminal) as let_go:
            terminal.until(b"jog tare +0.00 V")  # the proof of the watchdog has been
            wait_for(lambda: volts(bench)[-1][1] == pytest.approx(3.0, abs=0.03))
            yield bench, process, terminal, let_go


def zero_after(bench: RunningBench, since: float) -> float:
    """s from `since` until the last command is 0, and that it stays."""
    wait_for(lambda: volts(bench)[-1][1] == 0.0)
    return next(t for t, v in reversed(volts(bench)) if v == 0.0) - since


@pytest.mark.alone
def test_let_go_is_zero_and_a_press_drives_again(tmp_path):
    with jogging(tmp_path) as (bench, process, terminal, let_go):
        time.sleep(2.5)
        let_go()
        assert zero_after(bench, time.monotonic()) < 1.0
        with held(terminal):
            wait_for(lambda: volts(bench)[-1][1] > 0.0)
        assert zero_after(bench, time.monotonic()) < 1.0
        terminal.press(b"q")
        terminal.until(b"as it should be: a positive command gives positive thrust and positive rotation")
        assert process.wait(20.0) == 0


@pytest.mark.alone
@pytest.mark.parametrize("how", ["killed", "hung up"])
def test_a_front_end_that_is_gone_is_zero(tmp_path, how):
    with jogging(tmp_path) as (bench, process, terminal, let_go):
        let_go()
        since = time.monotonic()
        if how == "killed":
            os.kill(process.pid, signal.SIGKILL)
        else:
            terminal.close()
        assert zero_after(bench, since) < 1.0


@pytest.mark.alone
@pytest.mark.parametrize(
    ("which", "faults", "said"),
    [
        ("simulated", (), "as it should be"),
        ("roboteq", ("motor backwards",), "both are reversed: swap two motor wires"),
        (
            "roboteq",
            ("load_cell sign",),
            "the force is reversed and the rotation is not: look which way the water goes",
        ),
    ],
    ids=["VESC", "two wires", "cell"],
)
def test_direction_of_a_bounded_jog(tmp_path, capsys, which, faults, said):
    bench_file = files(tmp_path, which)
    with running(tmp_path / "world.toml", tmp_path / "ports") as bench:
        for fault in faults:
            bench.tell(f"fault {fault}")
        status = main(["jog", str(bench_file), "3", "--for", "2", "--output", str(tmp_path / "out")])
        assert volts(bench)[-1][1] == 0.0
    captured = capsys.readouterr()
    assert said in captured.out, captured.err
    assert status == 0, captured.err
