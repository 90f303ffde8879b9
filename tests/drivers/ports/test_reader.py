"""One thread for all ports: each gets its own, whatever befalls the others."""

import os
import threading
import time

from drivers.ports.reader import READER, Port, Reader
from tests.drivers.scripted_peer import wait_until


class Heard:
    """A pipe that is read, and what was told of it."""

    def __init__(self, reader, label="port"):
        self.reader, self.label = reader, label
        self.far, self.near = None, None
        self.came, self.lost = [], []

    def __enter__(self):
        self.near, self.far = os.pipe()
        os.set_blocking(self.near, False)
        self.reader.watch(
            self.near, Port(self.label, lambda t_ns, data: self.came.append((t_ns, data)), self.lost.append)
        )
        return self

    def __exit__(self, *_):
        self.reader.forget(self.near)
        for descriptor in (self.near, self.far):
            if descriptor is not None:
                os.close(descriptor)

    def say(self, data):
        os.write(self.far, data)

    @property
    def text(self):
        return b"".join(data for _, data in self.came)


def reading():
    return [thread for thread in threading.enumerate() if thread.name == "reader"]


def test_every_port_is_told_what_is_its_own_and_when():
    reader = Reader()
    with Heard(reader) as one, Heard(reader) as two:
        before = time.monotonic_ns()
        one.say(b"a")
        two.say(b"b")
        wait_until(lambda: one.came and two.came)
        assert (one.text, two.text) == (b"a", b"b")
        assert before <= one.came[0][0] <= time.monotonic_ns()
        assert len(reading()) == 1


def test_the_thread_ends_with_the_last_port_and_begins_with_the_next():
    reader = Reader()
    for _ in range(3):
        with Heard(reader) as port:
            port.say(b"x")
            wait_until(lambda port=port: port.came)
        wait_until(lambda: not reading())


def test_a_port_that_is_forgotten_hears_nothing_more():
    reader = Reader()
    with Heard(reader) as kept, Heard(reader) as forgotten:
        reader.forget(forgotten.near)
        reader.forget(forgotten.near)
        forgotten.say(b"x")
        kept.say(b"y")
        wait_until(lambda: kept.came)
        assert not forgotten.came
        assert not forgotten.lost


def test_a_port_that_goes_is_told_of_and_the_others_are_read_on():
    reader = Reader()
    with Heard(reader, "gone") as gone, Heard(reader) as kept:
        os.close(gone.far)
        gone.far = None
        wait_until(lambda: gone.lost)
        assert gone.lost == ["gone was lost (the device has gone): check adapter, cable and power, then open it again"]
        kept.say(b"y")
        wait_until(lambda: kept.came)


def test_an_error_of_one_port_s_program_ends_that_port_alone(capfd):
    reader = Reader()

    def broken(t_ns, data):
        raise KeyError("a mistake in a driver")

    with Heard(reader, "broken") as spoilt, Heard(reader) as kept:
        reader.forget(spoilt.near)
        reader.watch(spoilt.near, Port("broken", broken, spoilt.lost.append))
        spoilt.say(b"x")
        wait_until(lambda: spoilt.lost)
        assert spoilt.lost == ["the reader of broken stopped on an error of this program (see the log)"]
        kept.say(b"y")
        wait_until(lambda: kept.came)
    assert "a mistake in a driver" in capfd.readouterr().err


def test_who_forgets_a_port_waits_for_what_is_being_told():
    reader, begun, told = Reader(), threading.Event(), []

    def slow(t_ns, data):
        begun.set()
        time.sleep(0.1)
        told.append(data)

    with Heard(reader) as port:
        reader.forget(port.near)
        reader.watch(port.near, Port("slow", slow, port.lost.append))
        port.say(b"x")
        assert begun.wait(2.0)
        reader.forget(port.near)
        assert told == [b"x"]


def test_a_process_that_was_forked_off_reads_with_a_thread_of_its_own():
    reader = READER
    with Heard(reader) as ours:
        child = os.fork()
        if child == 0:
            with Heard(reader) as its:
                its.say(b"x")
                end = time.monotonic() + 5.0
                while not its.came and time.monotonic() < end:
                    time.sleep(0.01)
                os._exit(0 if its.text == b"x" and not ours.came else 1)
        assert os.waitpid(child, 0)[1] == 0
        ours.say(b"y")
        wait_until(lambda: ours.came)


def test_four_ports_of_a_thousand_lines_a_second_lose_none():
    reader = Reader()
    with Heard(reader) as first, Heard(reader) as second, Heard(reader) as third, Heard(reader) as fourth:
        ports = (first, second, third, fourth)
        for k in range(600):
            for port in ports:
                port.say(b"%06d\n" % k)
            time.sleep(0.001)
        wait_until(lambda: all(len(port.text) == 7 * 600 for port in ports))
    for port in ports:
        stamps = [t_ns for t_ns, _ in port.came]
        assert stamps == sorted(stamps)
        assert port.text == b"".join(b"%06d\n" % k for k in range(600))
