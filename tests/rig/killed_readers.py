"""Children that read recordings, killed from outside as the system does when memory runs out."""

import os
import signal

from rig.hdf5 import apart


def killed_readers(monkeypatch, first=0, most=10**9):
    """From here on: the child of number `first` and those after it, `most` in all. The numbers of those begun."""
    begun, begin, attempt = [], apart._begin, apart._attempt

    def counted(*arguments):
        begun.append(len(begun))
        monkeypatch.setattr(apart, "_attempt", _killed if first <= begun[-1] < first + most else attempt)
        return begin(*arguments)

    monkeypatch.setattr(apart, "_begin", counted)
    return begun


def _killed(_work):
    os.kill(os.getpid(), signal.SIGKILL)
