"""A controller process that comes up slowly, or not at all: the operator is told, and its log says at least that."""

import subprocess
import sys
import threading

import pytest

from rig.errors import LinkError
from rig.link.live_runs import Run, register
from rig.operate.run import LOG_NAME, START_TIMEOUT, listening, start_controller


@pytest.fixture
def slow():
    """A process that is there and says nothing."""
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    yield process
    process.kill()
    process.communicate()


def test_slow_start_is_told_and_waited_for(tmp_path, capsys, slow):
    announced = []
    later = threading.Timer(
        0.5, lambda: announced.append(register(Run(slow.pid, "socket", str(tmp_path), "campaign", "bench")))
    )
    later.start()
    try:
        assert listening(slow, tmp_path, news=0.1).pid == slow.pid
    finally:
        later.join()
        announced[0].unlink(missing_ok=True)
    said = capsys.readouterr().err
    assert f"the controller (process {slow.pid}) still starts" in said
    assert f"it is waited for {START_TIMEOUT:g} s, Ctrl+C ends it" in said


def test_controller_that_ends_at_once_and_the_log_of_one_that_says_nothing(tmp_path, slow):
    (tmp_path / "campaign.toml").write_text("[campaign]\n")
    with pytest.raises(LinkError, match=r"ended at once: .*campaign\.toml"):
        start_controller(tmp_path / "campaign.toml", tmp_path, ())
    lines = (tmp_path / LOG_NAME).read_text().splitlines()
    assert lines[0].startswith("the controller process is started at 20")
    (tmp_path / LOG_NAME).write_text(lines[0] + "\n")
    slow.communicate(b"\n")
    with pytest.raises(LinkError, match="ended at once: it said nothing"):
        listening(slow, tmp_path)
