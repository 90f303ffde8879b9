"""Recordings, benches, campaigns and maps that were changed, through the command line."""

from __future__ import annotations

import os
import re
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from rig.hdf5 import RecordingFile
from rig.importing.mapping import shipped
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec

from .command_line import attempt, warm
from .mutation import Tally, mutant

ROOT = Path(__file__).resolve().parents[2]
STREAMS = (
    StreamSpec("load_cell", "sim", (ChannelSpec("thrust", "thrust", "N", noise_std=0.05),)),
    StreamSpec("command", "rig", (ChannelSpec("command_voltage", "command_voltage", "V"),)),
)


def recordings(folder: Path) -> dict[str, bytes]:
    """A closed recording, one as a kill leaves it, and one as it is half a second later."""
    path = folder / "seed.h5"
    file = RecordingFile(path, {"recording_id": "id", "thruster": "T1\x1b]0;x\x07", "notes": "\u202e"}, STREAMS, 0)
    rng, found = np.random.default_rng(0), {}
    for level in range(8):
        volts = 2.5 * level
        t_ns = np.arange(level * 400, level * 400 + 400) * 10_000_000
        thrust = 0.4 * volts * abs(volts) + 0.05 * rng.standard_normal((400, 1))
        file.add_rows(Rows(0, t_ns, thrust))
        file.add_rows(Rows(1, t_ns[:1], np.array([[volts]])))
        file.add_step(StepRow(level, "hold", volts, t_ns[0] * 1e-9, t_ns[-1] * 1e-9))
        file.add_event(EventRow(t_ns[0] * 1e-9, "info", f"level {level}"))
        file.flush()
        found["killed" if level < 6 else "grown"] = path.read_bytes()
    file.close("completed", "", 32.0)
    return found | {"closed": path.read_bytes()}


@contextmanager
def growing(path: Path, later: bytes, seed: int) -> Iterator[None]:
    """Pieces of what the file becomes are written into it, in any order, while it is read."""
    child = os.fork()
    if child == 0:
        rng = np.random.default_rng(seed)
        descriptor = os.open(path, os.O_WRONLY)
        for _ in range(2000):
            at = int(rng.integers(len(later)))
            os.pwrite(descriptor, later[at : at + 4096], at)
        os._exit(0)
    try:
        yield
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def run_recordings(count: int, seed: int, folder: Path) -> list[Tally]:
    """A third closed, a third killed, a third growing; `rig fit` and `rig recover` in turn."""
    warm("fit", "recover")
    place = folder / "work"
    place.mkdir(parents=True, exist_ok=True)
    (place / "seed.h5").unlink(missing_ok=True)
    seeds = recordings(place)
    found = []
    for index, kind in enumerate(("closed", "killed", "growing")):
        rng = np.random.default_rng([seed, index])
        tally = Tally(f"recordings, {kind}", folder)
        start = [seeds["closed"]] if kind == "closed" else [seeds["killed"]]
        for number in range((count + 2 - index) // 3):
            data = mutant(rng, start)
            path, out = place / "mutant.h5", place / "out.h5"
            path.write_bytes(data)
            out.unlink(missing_ok=True)
            words = ["fit", "mutant.h5"] if number % 2 else ["recover", "mutant.h5", "-o", "out.h5"]
            if kind == "growing":
                with growing(path, seeds["grown"], number):
                    _judge(tally, f"{kind}-{seed}-{number}.h5", words, place, data)
            else:
                _judge(tally, f"{kind}-{seed}-{number}.h5", words, place, data)
        found.append(tally)
    return found


def _judge(tally: Tally, name: str, words: list[str], place: Path, data: bytes) -> None:
    made = attempt(words, place)
    if made.wrong:
        tally.fail(name, f"rig {' '.join(words)}: {made.wrong}", data)
    else:
        tally.add(f"status {made.status}", made.seconds)


def run_tomls(count: int, seed: int, folder: Path) -> list[Tally]:
    """Campaign and bench through `rig check`, maps through `rig import`."""
    warm("check", "import")
    place = folder / "work"
    shutil.rmtree(place, ignore_errors=True)
    (place / "benches").mkdir(parents=True)
    (place / "log.csv").write_text("t,V,F\n" + "".join(f"{i / 10},{i // 40},{i * 0.01}\n" for i in range(400)))
    campaigns = [path.read_bytes() for path in sorted((ROOT / "campaigns").glob("*.toml"))]
    bench = (ROOT / "benches" / "simulated" / "bench.toml").read_bytes()
    (place / "benches" / "ports").mkdir()
    for port in re.findall(r"ports/(\w+)", bench.decode()):  # `rig check` looks whether they are there
        (place / "benches" / "ports" / port).touch()
    maps = [path.read_bytes() for path in shipped().values()]
    own = (
        b'about = "x"\nthruster = "T1"\n[time]\ncolumn = "t"\n'
        b'[streams.s.channels.thrust]\ncolumn = "F"\nquantity = "thrust"\nunit = "N"\n'
    )
    kinds: tuple[tuple[str, list[bytes], Callable[[bytes], list[str]]], ...] = (
        ("campaigns", campaigns, lambda data: _campaign(place, data, bench)),
        ("benches", [bench], lambda data: _campaign(place, campaigns[0], data)),
        ("maps", [*maps, *[own] * len(maps)], lambda data: _map(place, data)),
    )
    found = []
    for index, (kind, seeds, laid) in enumerate(kinds):
        rng, tally = np.random.default_rng([seed, 10 + index]), Tally(f"TOML, {kind}", folder)
        for number in range((count + 2 - index) // 3):
            data = mutant(rng, seeds)
            _judge(tally, f"{kind}-{seed}-{number}.toml", laid(data), place, data)
        found.append(tally)
    return found


def _campaign(place: Path, campaign: bytes, bench: bytes) -> list[str]:
    (place / "c.toml").write_bytes(campaign.replace(b"../benches/simulated/bench.toml", b"benches/b.toml"))
    (place / "benches" / "b.toml").write_bytes(bench)
    return ["check", "c.toml"]


def _map(place: Path, data: bytes) -> list[str]:
    (place / "m.toml").write_bytes(data)
    (place / "log.h5").unlink(missing_ok=True)
    return ["import", "log.csv", "--map", "m.toml"]
