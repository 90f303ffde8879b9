"""Device side of a CiA 402 drive on CANopen: state machine, profile velocity and torque, quick stop, its watchdog.

Source: CiA 402-2 / IEC 61800-7-201 (state machine, transitions 0 to 16, option codes 0x6007, 0x605A), CiA 301 for the
rest (node.py). Nothing is shared with the driver, nor with the library that it stands on.
"""

from __future__ import annotations

from collections.abc import Callable

from sim_devices.instruments.canopen.drive_options import Cia402Options, Measured
from sim_devices.instruments.canopen.node import Node
from sim_devices.instruments.canopen.objects import OUT_OF_RANGE, Object
from sim_devices.instruments.canopen.power_stage import PowerStage
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

STATUSWORDS = {
    "switch on disabled": 0x0250,
    "ready": 0x0231,
    "switched on": 0x0233,
    "enabled": 0x0237,
    "quick stop": 0x0217,
    "fault": 0x0218,
}
"""With the bits voltage enabled and remote."""
VELOCITY, TORQUE = 3, 4
ERRORS = {"over_current": (0x2310, 0x03), "over_temperature": (0x4310, 0x09), "under_voltage": (0x3220, 0x05)}
"""Fault -> error code, error register."""

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class Drive402:
    """One drive. `measure` gives what it measures; `gain` is rev/s of the thruster per V; `log` writes the truth."""

    faults = ("frozen", "silent", "broken_watchdog", *ERRORS, "disabled", "leaves_mode", "no_heartbeat", "reboot",
              "ignores_commands", "backwards", "redrives", "rate_factor", "current_factor")  # fmt: skip

    def __init__(
        self,
        options: Cia402Options,
        supply: float,
        gain: Callable[[], float],
        measure: Callable[[], Measured],
        log: Log,
    ) -> None:
        """`supply`: V."""
        self._options, self._supply, self._gain, self._measure, self._log = options, supply, gain, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._stage = PowerStage(gain, supply)
        self._state = "switch on disabled"
        self._word = 0
        self._told = (0, False)
        self._frozen: Measured | None = None
        name = f"{options.model} servo drive"
        self.node = Node(options.node_id, 0x00020192, name, self._refresh, self._written, self._lost, self._start)
        self._fill()
        self.node.deliver()

    def _start(self) -> None:
        """As after power-up."""
        self._state, self._word = "switch on disabled", 0
        self._say_command()

    def _fill(self) -> None:
        """The dictionary as delivered."""
        o, objects = self._options, self.node.objects
        options = {0x6007: ("h", 1, (0, 1, 2, 3)), 0x605A: ("h", 2, (0, 1, 2, 5, 6)), 0x605E: ("h", 2, (0, 1, 2))}
        for index, (form, value, allowed) in options.items():
            objects[index, 0] = Object(form, value, True, _one_of(allowed))
        shown = {0x603F: ("H", 0), 0x6041: ("H", 0), 0x6061: ("b", 0), 0x606C: ("i", 0), 0x6077: ("h", 0)}
        shown |= {0x6078: ("h", 0), 0x6079: ("I", 0), 0x6502: ("I", o.modes)}
        shown |= {0x6075: ("I", round(1e3 * o.rated_current)), 0x6076: ("I", round(1e3 * o.rated_torque))}
        written = {0x6040: ("H", 0), 0x6060: ("b", 0), 0x60FF: ("i", 0), 0x6071: ("h", 0), 0x6072: ("H", 1000)}
        written |= {0x607F: ("I", o.max_velocity), 0x60A9: ("I", 0x00B44700)}
        written |= dict.fromkeys((0x6083, 0x6084, 0x6085), ("I", o.acceleration))
        for places, writable in ((shown, False), (written, True)):
            for index, (form, value) in places.items():
                objects[index, 0] = Object(form, value, writable)
        if o.velocity_unit != 1.0:
            del objects[0x60A9, 0]
        for mapped in ((0x60410010,), (0x60410010, 0x60610008), (), ()):
            self.node.add_sent(mapped)
        for mapped in ((0x60400010,), (0x60400010, 0x60600008), (), ()):
            self.node.add_received(mapped)
        for place in [place for place in objects if f"{place[0]:04x}" in [each.lower() for each in o.lacks]]:
            del objects[place]

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def state(self) -> str:
        return self._state

    @property
    def speed(self) -> float:
        """rev/s that its loop follows."""
        return self._stage.ramp

    @property
    def _per_count(self) -> float:
        """rev/s of the propeller for one count of velocity."""
        return self._options.velocity_unit / 60.0 / self._options.gear_ratio

    def _value(self, index: int) -> int:
        return self.node.objects.number(index)

    def drive(self, n: float, dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that the windings carry amps."""
        if self._fault == "redrives":
            return self._amount * self._supply, 0.0
        if self._state == "quick stop":
            volts = self._stage.follow(0.0, self._value(0x6085) * self._per_count, n, dt)
            if self._stage.stands(n) and self._value(0x605A) < 5:
                self._enter("switch on disabled")
            return volts, 0.0
        if self._state != "enabled" or self._value(0x6061) not in (VELOCITY, TORQUE):
            return None, 0.0
        sign = -1.0 if self._fault == "backwards" else 1.0
        if self._value(0x6061) == TORQUE:
            return None, sign * self._clipped(0x6071, 0x6072) * 1e-3 * self._options.rated_current
        target = sign * self._clipped(0x60FF, 0x607F) * self._per_count
        index = 0x6083 if abs(target) > abs(self._stage.ramp) else 0x6084
        return self._stage.follow(target, self._value(index) * self._per_count, n, dt), 0.0

    def _clipped(self, index: int, limit: int) -> int:
        """A set-point beyond the drive's own limit is cut, and nobody is told."""
        largest = self._value(limit)
        return min(max(self._value(index), -largest), largest)

    # -- the state machine -------------------------------------------------------------------------------------------

    def _enter(self, state: str) -> None:
        if state == self._state:
            return
        if state in ("enabled", "quick stop") and self._state not in ("enabled", "quick stop"):
            self._stage.begin(self._measure().rotation_rate)
        self._state = state
        self.node.touch()
        self._say_command()

    def _obey(self, word: int) -> None:
        """Transitions that a controlword asks for."""
        edge, self._word = word & ~self._word & 0x80, word
        if self._state == "fault":
            if edge:
                self.node.emergency(0, 0)
                self.node.objects[0x603F, 0].value = 0
                self._enter("switch on disabled")
            return
        if not word & 0x02:
            self._enter("switch on disabled")
        elif not word & 0x04:
            self._enter("quick stop" if self._state in ("enabled", "quick stop") else "switch on disabled")
        elif word & 0x07 == 0x06:
            self._enter("ready" if self._state != "quick stop" else self._state)
        elif word & 0x0F == 0x07:
            steps = {"ready": "switched on", "enabled": "switched on"}
            self._enter(steps.get(self._state, self._state))
        else:
            steps = {"ready": "switched on", "switched on": "enabled"}
            steps |= {"quick stop": "enabled"} if self._value(0x605A) >= 5 else {}
            self._enter(steps.get(self._state, self._state))

    def _fail(self, code: int, register: int) -> None:
        self.node.objects[0x603F, 0].value = code
        self.node.emergency(code, register)
        self._enter("fault")

    def _lost(self, _t: float) -> None:
        """The heartbeat that it waits for has stopped."""
        if self._fault == "broken_watchdog" or self._options.broken_watchdog:
            return
        option = self._value(0x6007)
        driving = self._state == "enabled"
        if option == 1:
            self.node.objects[0x603F, 0].value = 0x8130
            self._enter("fault")
        elif option == 2:
            self._enter("switch on disabled")
        elif option == 3:
            self._enter("quick stop" if driving else "switch on disabled")
        if option:
            self._log("timeout", volts=0.0, after=_t - self.node.heard)

    # -- the bus -----------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self.node.due

    def tick(self, t: float) -> list[CanFrame]:
        return self.node.tick(t)

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        if self._fault == "ignores_commands" and frame.id == 0x200 + self.node.id:
            return []
        return self.node.receive(frame, t)

    def _written(self, index: int, _sub: int, _t: float) -> None:
        objects = self.node.objects
        if index == 0x6040:
            self._obey(self._value(0x6040))
        elif index == 0x6060 and not self._options.keeps_mode:
            objects[0x6061, 0].value = self._value(0x6060)
        elif index == 0x6007 and self._options.keeps_option:
            objects[0x6007, 0].value = 1
        elif index in (0x60FF, 0x6071):
            self._say_command()

    def _say_command(self) -> None:
        """To the truth log, when what the motor is told has changed."""
        enabled = self._state == "enabled"
        torque = self._value(0x6061) == TORQUE
        value = self._value(0x6071 if torque else 0x60FF) if enabled else 0
        if (value, enabled) != self._told:
            self._told = (value, enabled)
            volts = 0.0 if value == 0 else None if torque else value * self._per_count / self._gain()
            self._log("command", mode="torque" if torque else "velocity", value=value, volts=volts)

    def _refresh(self) -> None:
        """What it tells of now."""
        o, objects = self._options, self.node.objects
        if self._fault != "frozen" or self._frozen is None:
            self._frozen = self._measure()
        now = self._frozen
        rate = now.rotation_rate * (self._amount if self._fault == "rate_factor" else 1.0)
        share = now.current * (self._amount if self._fault == "current_factor" else 1.0) / o.rated_current
        told = {0x6041: STATUSWORDS[self._state], 0x606C: round(rate / self._per_count)}
        told |= {0x6077: round(1e3 * share), 0x6078: round(1e3 * share), 0x6079: round(1e3 * now.bus_voltage)}
        for index, value in told.items():
            if (index, 0) in objects:
                objects[index, 0].value = value

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Those with an error code stop the motor, as the standard has it."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name in ERRORS:
            self._fail(*ERRORS[name])
        elif name == "disabled":
            self._enter("switch on disabled")
        elif name == "leaves_mode":
            self.node.objects[0x6061, 0].value = 0
            self._say_command()
        elif name == "reboot":
            self.node.boot(t)
        else:
            self._fault, self._amount = name, amount
            self.node.deaf, self.node.beats = name == "silent", name != "no_heartbeat"

    def clear(self, _t: float) -> None:
        self._fault, self.node.deaf, self.node.beats = "", False, True


def _one_of(allowed: tuple[int, ...]) -> Callable[[int], int]:
    return lambda value: 0 if value in allowed else OUT_OF_RANGE
