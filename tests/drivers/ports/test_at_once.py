"""A device that asks on by what it hears hears it when it comes, not when somebody looks."""

import pytest

from drivers.ports.lines import LineCutter
from drivers.ports.serial_port import SerialPort, SerialSettings
from tests.drivers.scripted_peer import Peer, wait_until


@pytest.mark.parametrize("at_once", [True, False])
def test_one_question_follows_the_other_by_itself(at_once):
    asked = []

    def feed(data):
        lines = LineCutter().feed(data)
        asked.extend(lines)
        if lines == [b"1"]:
            port.write(b"second\n")
        return lines

    with Peer(lambda peer, request: peer.send(b"1\n" if request == b"first" else b"2\n")) as peer:
        port = SerialPort("cell", SerialSettings(peer.port, 9600), feed, at_once=at_once)
        port.open()
        port.write(b"first\n")
        if at_once:
            wait_until(lambda: asked == [b"1", b"2"])
        else:
            wait_until(lambda: peer.heard == [b"first"])
            assert not asked
            assert [line for _, line in port.inbox.take_all()] in ([], [b"1"])
        port.close()
