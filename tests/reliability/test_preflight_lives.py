"""Cables that are pulled and put back while the operator looks at the preflight, over real bytes."""

from __future__ import annotations

import select
import time
from collections.abc import Callable

import pytest

from rig.link.front_end_messages import Request, Snapshot
from tests.reliability.live import NOT_BEGUN, FrontEnd, attach, live_bench

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(120)]


def look(front: FrontEnd, wanted: Callable[[Snapshot], bool], what: str) -> Snapshot:
    """Attend, and start nothing, until a snapshot is as wanted."""
    end = time.monotonic() + 30.0
    while time.monotonic() < end and not front.peer.closed:
        front.peer.send(Request("lease"))
        select.select([front.peer], [], [], 0.1)
        for message in front.peer.receive():
            assert isinstance(message, Snapshot)
            front.last = message
            if wanted(message):
                return message
    raise AssertionError(f"{what}: {front.last.checks if front.last else 'no snapshot came'}")


def rows(snapshot: Snapshot) -> dict[str, str]:
    return {check.name: check.verdict for check in snapshot.checks}


def ready(snapshot: Snapshot) -> bool:
    verdicts = rows(snapshot)
    return snapshot.state == "preflight" and len(verdicts) > 5 and not {"failed", "waiting"} & set(verdicts.values())


@pytest.mark.parametrize(("port", "device"), [("load_cell", "load_cell"), ("can0", "motor")])
def test_cable_pulled_and_put_back(tmp_path, port, device):
    with live_bench(tmp_path) as bench:
        front = attach(bench.start(unattended=False, dwell=0.6))
        try:
            look(front, ready, "the preflight passes")
        except AssertionError as error:
            raise AssertionError(f"{NOT_BEGUN}: {error}") from error
        bench.tell("fault", port, "pulled")
        look(front, lambda s: rows(s)[device] == "failed", f"{device} turns red")
        front.peer.send(Request("start"))
        look(front, lambda s: any("not started" in line.text for line in s.log), "it is not started")
        bench.tell("clear", port)
        look(front, ready, f"{device} is back")
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        assert len(list((bench.folder / "out").iterdir())) == 1, "in the same folder"
        driven = [line for line in bench.truth() if line["event"] == "command" and line.get("value")]
        back = [line for line in bench.truth() if line["event"] == "clear"]
        assert driven[0]["t_ns"] > back[0]["t_ns"], "nothing turned before"
