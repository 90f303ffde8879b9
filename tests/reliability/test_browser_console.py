"""A console in a browser (`rig console --serve`): its stop key, and what the loss of each part of the way does to the
motor, by the bench's truth log."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from rig.link.live_runs import Run
from tests.reliability.live import LiveBench, live_bench, zero_after
from tests.reliability.test_console_stop import RIG, ended
from tests.rig.serve.played import CTRL_C, F5, F9, Screen, seats, stranger, until

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]


@asynccontextmanager
async def server(run: Run) -> AsyncIterator[tuple[asyncio.subprocess.Process, str]]:
    """`rig console --serve` on that run, and its link."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", RIG, "console", run.folder, "--serve", "--port", "0", "--no-report",
        stdout=asyncio.subprocess.PIPE, stdin=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        while "token=" not in (line := (await process.stdout.readline()).decode()):
            assert line
        yield process, line.strip()
    finally:
        if process.returncode is None:
            process.terminate()
        await asyncio.wait_for(process.communicate(), 20.0)
        await until(lambda: not seats(run.folder), 5.0)


@asynccontextmanager
async def at_browser(bench: LiveBench, run: Run) -> AsyncIterator[tuple[int, Screen]]:
    """A browser's console that attends and has started the motor, which holds 10 V; and the number of its server."""
    async with server(run) as (process, link), stranger() as browser:
        async with browser.get(link) as answer:
            room = str(answer.url)
        origin = room.rsplit("/", 2)[0]
        screen = Screen(await browser.ws_connect(f"{room}ws?width=100&height=30", origin=origin))
        await screen.until_drawn("Press F5 to start")
        await screen.press("l")
        await screen.press(F5)
        await asyncio.to_thread(bench.until_held, 10.0, 0.5)
        yield process.pid, screen
        await screen.close()


@pytest.mark.parametrize("key", [F9, CTRL_C], ids=["F9", "Ctrl+C"])
async def test_stop_key_of_a_browser_to_command_0(tmp_path, prompt, key):
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        async with at_browser(bench, run) as (_, screen):
            pressed = time.monotonic_ns()
            await screen.press(key)
            await asyncio.to_thread(bench.until_held, 0.0, 0.3)
            await screen.until_drawn("ABORTED")
        prompt(zero_after(bench.truth(), pressed), 0.13, pressed)
        assert ended(bench, run) == ("aborted", "stopped by console")


async def test_ctrl_c_where_the_server_runs_is_the_stop_key(tmp_path, prompt):
    """The server stays, and its browser shows how it ended."""
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        async with at_browser(bench, run) as (pid, screen):
            pressed = time.monotonic_ns()
            os.kill(pid, signal.SIGINT)
            await asyncio.to_thread(bench.until_held, 0.0, 0.3)
            await screen.until_drawn("ABORTED")
        prompt(zero_after(bench.truth(), pressed), 0.13, pressed)
        assert ended(bench, run) == ("aborted", "stopped by rig console --serve")


async def lost(screen: Screen, _: int, __: Run) -> None:
    """Its tab is closed."""
    await screen.close()


async def server_killed(_: Screen, pid: int, __: Run) -> None:
    os.kill(pid, signal.SIGKILL)


async def server_ended(_: Screen, pid: int, __: Run) -> None:
    os.kill(pid, signal.SIGTERM)


async def console_killed(_: Screen, __: int, run: Run) -> None:
    for seat in seats(run.folder):
        os.kill(seat, signal.SIGKILL)


async def console_frozen(_: Screen, __: int, run: Run) -> None:
    for seat in seats(run.folder):
        os.kill(seat, signal.SIGSTOP)


LOSSES = {lost: 0.5, server_killed: 0.5, server_ended: 0.5, console_killed: 0.5, console_frozen: 2.3}
"""What is lost, and s that it may take to command 0: 2 s of lease where nothing else tells."""


@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: loss.__name__)
async def test_an_attended_run_that_loses_its_browser(tmp_path, prompt, loss):
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        async with at_browser(bench, run) as (pid, screen):
            since = time.monotonic_ns()
            await loss(screen, pid, run)
            await asyncio.to_thread(bench.until_held, 0.0, 0.3)
        prompt(zero_after(bench.truth(), since), LOSSES[loss], since)
        outcome, cause = ended(bench, run)
        assert outcome == "tripped"
        assert "operator" in cause


async def test_an_unattended_run_goes_on_without_its_browser(tmp_path):
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=True, dwell=2.0)
        async with at_browser(bench, run) as (_, screen):
            await screen.close()
        await asyncio.to_thread(bench.controllers[-1].wait, 60.0)
        assert ended(bench, run) == ("completed", "")
