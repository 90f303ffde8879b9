"""Bytes that wait for whoever wants to know what they say."""

import threading
from contextlib import nullcontext

import pytest

from drivers.ports.arrivals import MOST, Arrivals
from drivers.ports.inbox import Inbox
from tests.drivers.scripted_peer import wait_until


class Told:
    def __init__(self) -> None:
        self.chunks, self.threads, self.failures = [], [], 0

    def __call__(self, chunks):
        for t_ns, data in chunks:
            self.chunks.append((t_ns, data))
            self.threads.append(threading.current_thread())
            if data == b"!":
                raise KeyError("a mistake")

    def failed(self):
        self.failures += 1


def add_in_a_thread(arrivals, *chunks):
    thread = threading.Thread(target=lambda: [arrivals.add(t, data) for t, data in chunks])
    thread.start()
    thread.join()
    return thread


def test_nothing_is_decoded_before_somebody_looks():
    told = Told()
    arrivals = Arrivals(told, told.failed)
    add_in_a_thread(arrivals, (1, b"a"), (2, b"b"))
    assert told.chunks == []
    arrivals.decode()
    arrivals.decode()
    assert told.chunks == [(1, b"a"), (2, b"b")]
    assert told.threads == [threading.current_thread()] * 2


def test_no_more_than_so_many_chunks_are_kept():
    told = Told()
    arrivals = Arrivals(told, told.failed)
    reader = add_in_a_thread(arrivals, *((n, b"%d" % n) for n in range(MOST + 3)))
    assert [t for t, _ in told.chunks] == list(range(MOST))
    assert set(told.threads) == {reader}
    arrivals.decode()
    assert [t for t, _ in told.chunks] == list(range(MOST + 3))


@pytest.mark.parametrize("waits", [True, False])
def test_while_somebody_waits_it_is_decoded_as_it_comes(waits):
    told = Told()
    arrivals = Arrivals(told, told.failed)
    arrivals.add(1, b"before")
    with arrivals.awaited() if waits else nullcontext():
        assert len(told.chunks) == (1 if waits else 0)
        reader = add_in_a_thread(arrivals, (2, b"now"))
        assert told.threads[1:] == ([reader] if waits else [])
    add_in_a_thread(arrivals, (3, b"after"))
    assert len(told.chunks) == (2 if waits else 0)


def test_a_decoder_that_fails_is_told_once_and_no_more_is_decoded(capfd):
    told = Told()
    arrivals = Arrivals(told, told.failed)
    for data in (b"a", b"!", b"!"):
        arrivals.add(1, data)
    arrivals.decode()
    arrivals.add(2, b"b")
    arrivals.decode()
    assert [data for _, data in told.chunks] == [b"a", b"!"]
    assert told.failures == 1
    assert capfd.readouterr().err.count("Traceback") == 1


LOOKS = {
    "take_all": (lambda inbox: inbox.take_all(), [(7, b"x")]),
    "received": (lambda inbox: inbox.received, 1),
    "dropped": (lambda inbox: inbox.dropped, 0),
    "wait_for": (lambda inbox: inbox.wait_for(bool, 0.0), b"x"),
}


@pytest.mark.parametrize("way", LOOKS)
def test_every_way_to_look_into_an_inbox_decodes(way):
    look, wanted = LOOKS[way]
    arrivals = Arrivals(lambda chunks: inbox.put(chunks), lambda: None)
    inbox = Inbox(10, arrivals=arrivals)
    arrivals.add(7, b"x")
    assert look(inbox) == wanted
    assert inbox._received == 1


def test_who_waits_is_woken_by_what_a_reader_adds():
    arrivals = Arrivals(lambda chunks: inbox.put(chunks), lambda: None)
    inbox = Inbox(10, arrivals=arrivals)
    found = []
    waiter = threading.Thread(target=lambda: found.append(inbox.wait_for(lambda data: data == b"2", 30.0)))
    waiter.start()
    wait_until(lambda: arrivals._waiting)
    add_in_a_thread(arrivals, (1, b"1"), (2, b"2"))
    waiter.join(30.0)
    assert found == [b"2"]
    assert inbox.take_all() == [(1, b"1")]
