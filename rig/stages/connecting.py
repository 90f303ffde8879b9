"""The links to the devices before a propeller may turn: opened, watched, closed when they die, opened again later.

Never in a run: there a lost link ends it (docs/reliability.md, promise 6).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf

from drivers import KINDS
from rig.errors import DeviceError, LinkError
from rig.link.front_end_messages import Check, Request
from rig.stages.preflight import device_checks
from rig.stages.session import Session

RETRY = 3.0
"""s between two tries to open a device."""
PATIENCE = 5.0
"""Times that a try takes: the loop stands still, at 0 V, while a device is asked and does not answer."""
SILENT_PERIODS = 20
"""Sample periods without a row after which a link counts as dead, though its port is there ..."""
SILENT = 2.0
"""s, and at least so long: a device that was switched off and on again does not stream until it is opened anew."""


@dataclass
class Links:
    """Of all devices of the bench."""

    session: Session
    failures: dict[str, str] = field(default_factory=dict)
    """Device -> why it is not there."""
    due: dict[str, float] = field(default_factory=dict)
    """Device -> s, when it is tried again."""
    opened: dict[str, float] = field(default_factory=dict)
    """Device -> s, since when it is there."""

    @property
    def checks(self) -> list[Check]:
        """One line per device."""
        bench = self.session.bench
        return device_checks(bench.identities, self.failures, tuple(bench.instruments))

    def open_all(self) -> None:
        """Every device once; what does not open is in `failures`."""
        for name in self.session.bench.instruments:
            self.session.status.checks = self.checks
            self.session.turn()
            self._open(name)
        self.session.status.checks = self.checks

    def look(self, requests: Iterable[Request]) -> None:
        """Once a tick: close what died, try what is due or asked for."""
        now = self.session.loop.now
        for name in list(self.opened):
            if dead := self._dead(name, now):
                self._lose(name, f"{dead}; it is tried again every {RETRY:g} s")
        asked = {request.text for request in requests if request.kind == "retry"}
        for name in list(self.failures):
            if now >= self.due.get(name, -inf) or name in asked or "" in asked:
                self._open(name, again=True)

    def _dead(self, name: str, now: float) -> str:
        """Why a device that is open is not there; empty while it is."""
        instrument, readings = self.session.bench.instruments[name], self.session.loop.readings
        health = instrument.health()
        if not health.alive:
            return f"{name}: {(health.error or 'its link is gone').removeprefix(f'{name}: ')}"
        for stream in instrument.streams:
            latest = readings.latest.get(stream.name)
            since = self.opened[name] if latest is None else max(latest.t_ns * 1e-9, self.opened[name])
            if now - since > max(SILENT, SILENT_PERIODS * stream.period_s):
                return f"{name}: nothing came from {stream.name} for {now - since:.1f} s"
        return ""

    def _lose(self, name: str, why: str) -> None:
        """Close it, and its bus with everybody on it where that is dead."""
        session, config = self.session, self.session.campaign.bench
        session.say("error", why)
        lost = [name]
        if KINDS[config.devices[name].kind].link == "can":
            bus = config.devices[name].options.bus
            lost = [each for each in self.opened if _bus_of(config.devices[each]) == bus]
        for each in lost:
            session.bench.instruments[each].close()
            session.bench.identities.pop(each, None)
            self.failures[each] = why
            self.due[each] = session.loop.now + RETRY
            del self.opened[each]
            if each == config.motor:
                session.motor = None
        if lost and KINDS[config.devices[name].kind].link == "can":
            session.bench.buses[bus].close()

    def _open(self, name: str, *, again: bool = False) -> None:
        session, begun = self.session, self.session.loop.now
        streams = [stream.name for stream in session.bench.instruments[name].streams]
        session.loop.readings.forget(streams)
        try:
            identity = session.bench.open_device(name)
            self._require_same(name, identity)
        except (LinkError, DeviceError) as error:
            took = session.loop.now - begun
            self.due[name] = session.loop.now + max(RETRY, PATIENCE * took)
            if self.failures.get(name) != str(error):
                session.say("error", str(error))
            self.failures[name] = str(error)
            return
        self.failures.pop(name, None)
        self.opened[name] = session.loop.now
        session.say("info", f"{name}{' is back' if again else ''}: {identity}", of_bench=True)
        if name == session.campaign.bench.motor:
            session.loop.begin_link()
            session.motor = session.bench.motor

    def _require_same(self, name: str, identity: str) -> None:
        """A resumed campaign goes on with the devices it began with (docs/reliability.md, promise 23)."""
        session = self.session
        begun: dict[str, str] = next((fact["identities"] for fact in session.before if fact["fact"] == "start"), {})
        if begun.get(name, identity) != identity:
            session.bench.instruments[name].close()
            session.bench.identities.pop(name, None)
            raise DeviceError(
                f"{name} is {identity}, but the campaign was begun with {begun[name]}: put that back, or begin anew"
            )


def _bus_of(device: object) -> str:
    return str(getattr(getattr(device, "options", None), "bus", ""))
