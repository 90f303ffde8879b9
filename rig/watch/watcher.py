"""Main of the watcher process: `python -m rig.watch.watcher --fd N`, N an inherited connected socket.

It is given the rows of the running recording and says where it stops fitting (identification.watching). It runs at a
low priority and touches neither file nor motor: whatever happens to it, the run goes on.
"""

from __future__ import annotations

import argparse
import logging
import os
import select
import signal
import socket
import sys
from math import isfinite
from pathlib import Path

import numpy as np

from identification.recording import Floats
from identification.watching import Alarm, Settings, Watch
from rig.errors import LinkError, RigError, TwinError
from rig.link.framing import Message
from rig.link.recorder_messages import Failed, Rows
from rig.link.sockets import Peer
from rig.link.watch_messages import Judged, Mismatch, Standing, Watched

NICE = 10
"""Added to its niceness: it yields to the controller and the recorder."""


class Watcher:
    """One link, several runs one after another."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._run: Watched | None = None
        self._watch: Watch | None = None

    def serve(self) -> None:
        """Until the link ends. Raises LinkError for what is no order to a watcher."""
        while not self._peer.closed:
            select.select([self._peer], [self._peer] if self._peer.waiting else [], [])
            self.step()

    def step(self) -> None:
        """Take what came and say what there is to say; never waits."""
        self._peer.flush()
        for message in self._peer.receive():
            self._take(message)
        if self._watch is None or self._run is None:
            return
        before, found = self._watch.stretches, self._watch.look()
        if found is not None:
            self._peer.send(_said(found, self._run))
        if self._watch.stretches != before:
            self._peer.send(_judged(self._watch, self._run))

    def _take(self, message: Message) -> None:
        match message:
            case Watched():
                self._begin(message)
            case Rows():
                if self._watch is not None and self._run is not None:
                    feed(self._watch, self._run, message)
            case _:
                raise LinkError(f"the controller sent a {type(message).__name__}, which a watcher does not take")

    def _begin(self, run: Watched) -> None:
        self._run, self._watch = run, None
        try:
            self._watch = Watch(settings_of(run))
        except RigError as error:
            self._peer.send(Failed(str(error)))


def settings_of(run: Watched) -> Settings:
    """Raises TwinError for a twin that can't be read, is another thruster's or needs what is not fed."""
    if not run.twin:
        return Settings(run.highest, run.false_alarms_per_hour)
    from identification.mismatch.prepare.preparing import (
        Refusal,  # with a twin only: the catalogue takes seconds to import
    )
    from identification.watching.known import expected_of, gain_std
    from rig.twin.reading import read_twin

    twin = read_twin(Path(run.twin))
    if twin.thruster != run.thruster:
        raise TwinError(f"{run.twin} is the twin of {twin.thruster}, but {run.thruster} is on the bench")
    expected = expected_of(twin)
    if isinstance(expected, Refusal):
        raise TwinError(f"{run.twin}: {expected.reason}")
    return Settings(run.highest, run.false_alarms_per_hour, expected, gain_std(twin))


def feed(watch: Watch, run: Watched, rows: Rows) -> None:
    """Rows of one stream, each channel to where it belongs."""
    time: Floats = (rows.t_ns - run.t0_ns).astype(np.float64) * 1e-9
    for column, quantity in run.streams[rows.stream].columns:
        value = rows.values[:, column]
        match quantity:
            case "command_voltage":
                for t, volts in zip(time.tolist(), value.tolist(), strict=True):
                    watch.command(t, volts)
            case "thrust":
                watch.thrust(time, value)
            case "bus_voltage":
                watch.bus_voltage(time, value)
            case "flow_speed":
                watch.flow_speed(time, value)
            case _:
                watch.rotation_rate(time, value)


def _said(alarm: Alarm, run: Watched) -> Mismatch:
    return Mismatch(
        t0_ns=run.t0_ns,
        thruster=run.thruster,
        time=alarm.time,
        began=alarm.began,
        place=alarm.place,
        headline=alarm.headline,
        statement=alarm.statement,
        size=alarm.size,
        e_value=alarm.e_value,
    )


def _judged(watch: Watch, run: Watched) -> Judged:
    alarm = watch.alarm
    standing = None if alarm is None else Standing(
        place=alarm.place, what=alarm.what, headline=alarm.headline, began=alarm.began, from_start=alarm.from_start,
        sigma=alarm.sigma, brief=alarm.brief, advice=alarm.advice,
    )  # fmt: skip
    return Judged(run.t0_ns, watch.stretches, isfinite(watch.log_evidence), standing)


def main(arguments: list[str] | None = None) -> int:
    """Exit status: 0 the link ended in order; 3 it failed, and its log says why."""
    parser = argparse.ArgumentParser(prog="python -m rig.watch.watcher", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="inherited file descriptor of a connected AF_UNIX socket")
    fd = parser.parse_args(arguments).fd
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the controller owns this life
    os.nice(NICE)
    peer = Peer(socket.socket(fileno=fd), "controller")
    try:
        Watcher(peer).serve()
    except Exception as error:  # the top of a process: the run goes on unwatched, and is told so
        logging.exception("the watcher ends")
        peer.send(Failed(f"the watcher failed: {type(error).__name__}: {error}"))
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
