"""Promise 32: a reader that dies, wherever it was, is seen within three periods, and the guard ends the run for it.

It is killed as no error of the wire could: an exception out of nowhere, raised inside its thread by the interpreter.
"""

import ctypes
import threading
import time

import pytest

from drivers.modbus import keller
from drivers.ports.can_bus import CanBus
from drivers.ports.reader import READ_TIMEOUT
from drivers.serial_lines.line_stream import LineStream, Options
from rig.safety.guard import Vitals, allowances, check
from tests.drivers.collecting import quiet
from tests.drivers.scripted_peer import Peer, wait_until
from tests.drivers.test_driver_keller import transmitter

# the death that is tried here is the one that pytest would report
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")

PERIOD = 0.1
"""s of the streams here."""


def kill(thread: threading.Thread) -> int:
    """End a thread within, and say when: ns of the monotonic clock. One that waits (for a reply, `timeout` at most)
    ends when it wakes.
    """
    assert ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident), ctypes.py_object(SystemExit)) == 1
    return time.monotonic_ns()


def seen_after(device, died: int) -> float:
    """s until the device calls its link dead, and the guard trips for it."""
    wait_until(lambda: not device.health().alive)
    seen = (time.monotonic_ns() - died) * 1e-9
    vitals = Vitals(now=1.0, started=0.0, links={"cell": device.health()}, driven=1.0)
    trip = check((), {}, vitals, allowances(50.0))
    assert trip is not None
    assert (trip.source, trip.channel) == ("link", "cell")
    assert "stopped on an error of this program" in trip.cause
    return seen


def readers(before):
    return [thread for thread in threading.enumerate() if thread not in before and thread.name != "scripted peer"]


def test_reader_of_a_serial_port(report, prompt):
    with Peer(quiet) as peer:
        before = set(threading.enumerate())
        device = LineStream("cell", Options(peer.port, r"(?P<raw>-?\d+)", rate=1 / PERIOD, line_characters=9))
        peer.streaming = b"12\n"
        device.open()
        (reader,) = readers(before)
        died = kill(reader)
        seen = seen_after(device, died)
        report("reader of a serial port dies, to the trip", seen, "s")
        device.close()
    prompt(seen, max(3 * PERIOD, READ_TIMEOUT), died)


def test_reader_of_a_can_bus(report, prompt):
    with Peer(quiet, None) as peer:
        before = set(threading.enumerate())
        bus = CanBus("slcan", peer.port, 500_000)
        bus.open()
        (reader,) = readers(before)
        died = kill(reader)
        seen = seen_after(bus, died)
        report("reader of a CAN bus dies, to the trip", seen, "s")
        bus.close()
    prompt(seen, max(3 * PERIOD, 2 * READ_TIMEOUT), died)


@pytest.mark.parametrize(("which", "name"), [("poller", "poll cell"), ("reader", "reader")])
def test_poller_of_a_transmitter(which, name, report, prompt):
    with Peer(transmitter, terminator=None) as peer:
        before = set(threading.enumerate())
        device = keller.Keller("cell", keller.Options(peer.port, rate=1 / PERIOD, baud=115_200, timeout=0.2))
        device.open()
        (thread,) = [each for each in readers(before) if each.name == name]
        died = kill(thread)
        seen = seen_after(device, died)
        report(f"{which} of a transmitter dies, to the trip", seen, "s")
        device.close()
    prompt(seen, 3 * PERIOD, died)
