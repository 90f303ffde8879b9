"""Reader threads are as prompt as the loop of their process, in a process of their own."""

import os
import subprocess
import sys

import pytest

OPENS_A_PORT = """
import os, pty, threading, time
from drivers.ports.serial_port import SerialPort, SerialSettings
{before}
master, slave = pty.openpty()
port = SerialPort("cell", SerialSettings(os.ttyname(slave), 9600), lambda data: [data])
port.open()
(reader,) = [t for t in threading.enumerate() if t.name == "reader"]
wanted = {wanted}
deadline = time.monotonic() + 10.0
while (found := (os.sched_getscheduler(reader.native_id) & ~os.SCHED_RESET_ON_FORK,
                 os.sched_getparam(reader.native_id).sched_priority)) != wanted and time.monotonic() < deadline:
    time.sleep(0.01)
print(found == wanted, found)
port.close()
"""
RAISED = "os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))"


def permitted() -> bool:
    return (
        subprocess.run([sys.executable, "-c", f"import os; {RAISED}"], capture_output=True, check=False).returncode == 0
    )


@pytest.mark.parametrize("raised", [True, False])
def test_a_reader_is_one_below_the_loop(raised):
    if raised and not permitted():
        raised = False  # on such a machine no loop is raised either, and the reader has to be as the others
    wanted = (os.SCHED_FIFO, 9) if raised else (os.SCHED_OTHER, 0)
    text = OPENS_A_PORT.format(before=RAISED if raised else "", wanted=wanted)
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("True"), done.stdout
