"""Front ends over a real socket: leases, requests, who is dropped, and what a late one is given."""

import resource
from contextlib import contextmanager

import pytest

from rig.link.clients import FLOOD, MAX_CLIENTS, OVERDUE, PASSED_PER_TICK, SILENCE, TRACE_AT_ONCE, Clients
from rig.link.front_end_messages import Request, Snapshot
from rig.link.recorder_messages import Ready
from rig.link.sockets import connect, listen


def snapshot(text: str = "") -> Snapshot:
    return Snapshot(1, "c", "hold", "T1", 0.0, 0.0, (), (), (), (), 0, (), None, (), cause=text)


@contextmanager
def listening(folder):
    clients = Clients(listen(folder / "s.sock"))
    peers = []

    def front():
        peers.append(connect(folder / "s.sock", "the controller"))
        return peers[-1]

    try:
        yield clients, front
    finally:
        for peer in peers:
            peer.close()
        if clients.listener.fileno() >= 0:
            clients.close()


def test_a_lease_is_counted_and_not_passed_on(tmp_path):
    with listening(tmp_path) as (clients, front):
        peer = front()
        assert clients.lease_age(5.0) == 0.0
        for request in (Request("note", "a"), Request("lease"), Request("pause")):
            peer.send(request)
        assert [request.kind for request in clients.poll(5.0)] == ["note", "pause"]
        assert clients.lease_age(6.5) == 1.5


def test_who_starts_attends(tmp_path):
    with listening(tmp_path) as (clients, front):
        front().send(Request("start"))
        assert [request.kind for request in clients.poll(5.0)] == ["start"]
        assert clients.last_lease == 5.0


def test_closed_or_confused_front_ends_are_dropped_and_what_they_said_is_kept(tmp_path):
    with listening(tmp_path) as (clients, front):
        gone, confused = front(), front()
        gone.send(Request("stop", "last words"))
        gone.close()
        confused.send(Request("note", "x"))
        confused.send(Ready("I am a recorder"))
        assert {request.text for request in clients.poll(0.0)} == {"last words", "x"}
        assert clients.connected == []


def test_garbage_is_dropped(tmp_path):
    with listening(tmp_path) as (clients, front):
        front()._socket.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert clients.poll(0.0) == []
        assert clients.connected == []


def test_nobody_beyond_the_limit(tmp_path):
    with listening(tmp_path) as (clients, front):
        peers = [front() for _ in range(MAX_CLIENTS + 1)]
        clients.poll(0.0)
        assert len(clients.connected) == MAX_CLIENTS
        peers[-1].receive()
        assert peers[-1].closed


def test_who_does_not_read_is_dropped_and_the_others_hear_everything(tmp_path):
    with listening(tmp_path) as (clients, front):
        front()
        clients.poll(0.0)
        reader = front()
        clients.poll(0.0)
        heard = 0
        for _ in range(40):
            clients.publish(snapshot("x" * 2**18))
            clients.poll(0.0)
            heard += len(reader.receive())
        assert len(clients.connected) == 1
        while len(new := reader.receive()) or clients.connected[0].peer.waiting:
            heard += len(new)
            clients.poll(0.0)
        assert heard == 40


def test_trace_for_the_late_and_only_news_for_the_rest(tmp_path):
    with listening(tmp_path) as (clients, front):
        early = front()
        clients.poll(0.0)
        clients.add_trace((0.0, 1.0, 2.0))
        clients.publish(snapshot())
        late = front()
        clients.poll(0.0)
        clients.add_trace((0.1, 1.0, 2.0))
        clients.publish(snapshot())
        assert [len(s.trace) for s in early.receive()] == [1, 1]
        assert [len(s.trace) for s in late.receive()] == [2]
        for n in range(2 * TRACE_AT_ONCE):
            clients.add_trace((0.1 * n, 1.0, 2.0))
        sent = []
        for _ in range(3):
            clients.publish(snapshot())
            sent.append(early.receive()[0].trace)
        assert [len(rows) for rows in sent] == [TRACE_AT_ONCE, TRACE_AT_ONCE, 0]
        assert [row[0] for rows in sent for row in rows] == [0.1 * n for n in range(2 * TRACE_AT_ONCE)]
        clients.add_trace((99.0, 1.0, 2.0))
        clients.clear_trace()
        clients.publish(snapshot())
        assert early.receive()[0].trace == ()


def test_closing_takes_the_socket_file_away(tmp_path):
    with listening(tmp_path) as (clients, front):
        peer = front()
        clients.poll(0.0)
        clients.close()
        assert not (tmp_path / "s.sock").exists()
        peer.receive()
        assert peer.closed
        with pytest.raises(Exception, match="does not answer"):
            connect(tmp_path / "s.sock", "the controller")


def test_a_note_of_ten_megabytes_costs_only_its_sender(tmp_path):
    with listening(tmp_path) as (clients, front):
        loud, other = front(), front()
        loud.send(Request("note", "x" * 10_000_000))
        other.send(Request("note", "y"))
        texts = []
        for tick in range(20):
            texts += [request.text for request in clients.poll(0.02 * tick)]
            loud.flush()
        assert texts == ["y"]
        assert len(clients.connected) == 1
        clients.publish(snapshot())
        assert len(other.receive()) == 1


def test_a_note_of_500_letters_of_any_script_arrives(tmp_path):
    with listening(tmp_path) as (clients, front):
        front().send(Request("note", "\U0001f527" * 500))
        heard = [request.text for tick in range(3) for request in clients.poll(0.02 * tick)]
        assert heard == ["\U0001f527" * 500]


def test_who_floods_is_dropped_and_a_stop_comes_through(tmp_path):
    with listening(tmp_path) as (clients, front):
        flood, other = front(), front()
        for number in range(5000):
            flood.send(Request("note", str(number)))
        other.send(Request("stop", "now"))
        found = clients.poll(0.0)
        assert found[0] == Request("stop", "now")
        assert len(found) == PASSED_PER_TICK
        for tick in range(1, 5):
            clients.poll(0.02 * tick)
        assert len(clients.connected) == 1
        for _ in range(FLOOD):
            other.send(Request("lease"))
        clients.poll(2.0)
        assert len(clients.connected) == 1, "as many in a second as a person may cause"


def test_who_says_nothing_makes_room_at_once_and_is_dropped_later(tmp_path):
    with listening(tmp_path) as (clients, front):
        for _ in range(MAX_CLIENTS):
            front()
        clients.poll(0.0)
        late = front()
        late.send(Request("stop", "rig stop"))
        assert [request.kind for request in clients.poll(OVERDUE + 0.1)] == ["stop"]
        assert len(clients.connected) == MAX_CLIENTS
        for when in range(10, int(SILENCE) + 10, 5):
            late.send(Request("lease"))
            clients.poll(float(when))
        assert len(clients.connected) == 1


def test_half_a_message_is_silence(tmp_path):
    with listening(tmp_path) as (clients, front):
        front()._socket.sendall(b"\x10\x00\x00\x00\x02{")
        clients.poll(0.0)
        clients.poll(SILENCE + 1.0)
        assert clients.connected == []


def test_no_descriptor_left_is_no_end_of_a_run(tmp_path):
    with listening(tmp_path) as (clients, front):
        front()
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (0, hard))
        try:
            assert clients.poll(0.0) == []
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        clients.poll(0.1)
        assert len(clients.connected) == 1


def test_who_looks_on_is_obeyed_in_a_stop_alone_and_attends_nothing(tmp_path):
    with listening(tmp_path) as (clients, front):
        peer = front()
        for kind in ("watch", "pause", "start", "skip", "stop"):
            peer.send(Request(kind))
        assert [request.kind for request in clients.poll(1.0)] == ["stop"]
        assert (len(clients.connected), clients.attending, clients.last_lease) == (1, 0, None)
        peer.send(Request("lease"))
        peer.send(Request("pause"))
        assert [request.kind for request in clients.poll(2.0)] == ["pause"]
        assert (clients.attending, clients.last_lease) == (1, 2.0)


def test_a_snapshot_counts_those_that_attend(tmp_path):
    with listening(tmp_path) as (clients, front):
        attends, looks_on = front(), front()
        attends.send(Request("lease"))
        looks_on.send(Request("watch"))
        clients.poll(1.0)
        clients.publish(snapshot())
        assert [message.clients for message in attends.receive()] == [1]
