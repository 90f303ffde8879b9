"""The feed over a real socket pair: order, both directions, the end of file, and what is no message."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from rig.console.feed import SocketFeed
from rig.errors import LinkError
from rig.link.front_end_messages import Request
from rig.link.sockets import Peer
from tests.rig.console.feeds import running, snapshot


@asynccontextmanager
async def wire() -> AsyncIterator[tuple[SocketFeed, Peer]]:
    """A feed and the controller's end of it."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    feed, controller = SocketFeed(Peer(ours, "the controller")), Peer(theirs, "console")
    try:
        yield feed, controller
    finally:
        feed.close()
        controller.close()


async def test_snapshots_come_in_order_and_then_the_end():
    async with wire() as (feed, controller):
        controller.send(snapshot("preflight"))
        controller.send(running())
        assert await feed.receive() == snapshot("preflight")
        assert await feed.receive() == running()
        controller.close()
        assert await feed.receive() is None
        assert await feed.receive() is None


async def test_what_was_sent_before_the_end_is_still_delivered():
    async with wire() as (feed, controller):
        controller.send(running())
        controller.close()
        assert await feed.receive() == running()
        assert await feed.receive() is None


async def test_receive_waits_without_a_turn_of_polling():
    async with wire() as (feed, controller):
        waiting = asyncio.ensure_future(feed.receive())
        await asyncio.sleep(0)
        assert not waiting.done()
        controller.send(running())
        assert await waiting == running()


async def test_a_request_is_in_the_socket_before_send_returns():
    async with wire() as (feed, controller):
        feed.send(Request("stop", "console"))
        assert controller.receive() == [Request("stop", "console")]


async def test_a_controller_that_reads_late_gets_everything():
    async with wire() as (feed, controller):
        notes = [Request("note", "x" * 100_000) for _ in range(20)]
        for note in notes:
            feed.send(note)
        got: list[object] = []
        while len(got) < len(notes):
            got += controller.receive()
            await asyncio.sleep(0)
        assert got == notes


async def test_sending_to_nobody_is_an_error_once_the_end_was_seen():
    async with wire() as (feed, controller):
        controller.close()
        assert await feed.receive() is None
        with pytest.raises(LinkError, match=r"the controller is gone: the request `stop` reaches nobody"):
            feed.send(Request("stop"))


async def test_rubbish_ends_the_link_with_a_reason():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    feed = SocketFeed(Peer(ours, "the controller"))
    with theirs:
        theirs.sendall(b"\xff" * 64)
        assert await feed.receive() is None
        assert "not a rig process" in feed.fault
    feed.close()


async def test_close_shows_the_controller_the_end_of_file_twice_is_fine():
    async with wire() as (feed, controller):
        feed.close()
        feed.close()
        controller.receive()
        assert controller.closed
        assert await feed.receive() is None


async def test_what_another_thread_sends_comes_whole_between_the_loop_s_own():
    notes, stops = [Request("note", "x" * 50_000)] * 40, [Request("stop", "console")] * 400
    async with wire() as (feed, controller):
        thread = threading.Thread(target=lambda: [feed.send_from_thread(stop) for stop in stops])
        thread.start()
        got: list[object] = []
        for note in notes:
            feed.send(note)
            got += controller.receive()
            await asyncio.sleep(0)
        thread.join(20.0)
        while len(got) < len(notes) + len(stops):
            got += controller.receive()
            await asyncio.sleep(0)
        assert [each for each in got if each == stops[0]] == stops
        assert [each for each in got if each == notes[0]] == notes


async def test_what_the_kernel_did_not_take_of_another_thread_s_is_sent_on_by_the_loop():
    """No further request of the loop pushes it."""
    big = Request("note", "x" * 2_000_000)
    async with wire() as (feed, controller):
        feed.send(Request("stop", "console"))
        thread = threading.Thread(target=feed.send_from_thread, args=(big,))
        thread.start()
        thread.join(20.0)
        got = list(controller.receive())
        async with asyncio.timeout(20.0):
            while len(got) < 2:
                await asyncio.sleep(0)
                got += controller.receive()
        assert got[1] == big


async def test_another_thread_may_send_when_the_link_is_gone():
    async with wire() as (feed, controller):
        feed.close()
        feed.send_from_thread(Request("stop"))
        controller.receive()
        assert controller.closed
