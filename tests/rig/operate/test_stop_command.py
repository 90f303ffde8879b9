"""rig stop: what it says and with which status, by what the controller's last snapshot knows."""

from types import SimpleNamespace

import pytest

from rig.cli import main

PEER = SimpleNamespace(send=lambda request: None, close=lambda: None)


@pytest.mark.parametrize(
    ("last", "status", "said"),
    [
        (SimpleNamespace(stop_confirmed=True, cause="stopped by rig stop"), 0, "stopped by rig stop"),
        (SimpleNamespace(stop_confirmed=False, cause="stopped by rig stop"), 1, "cut the supply"),
        (None, 1, "cut the supply"),
    ],
)
def test_a_stop_that_nothing_confirms_is_no_success(monkeypatch, capsys, last, status, said):
    monkeypatch.setattr("rig.operate.run.find_run", lambda folder: SimpleNamespace(socket="s"))
    monkeypatch.setattr("rig.operate.run.connect", lambda path, name: PEER)
    monkeypatch.setattr("rig.operate.run.Headless", lambda peer: SimpleNamespace(follow=lambda start: last))
    assert main(["stop"]) == status
    out, err = capsys.readouterr()
    assert said in (err if status else out)
