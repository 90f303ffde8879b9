"""The day of one operator at one terminal: from `rig init` to the comparison of fits."""

from __future__ import annotations

import re
import time
import tomllib
from dataclasses import dataclass

from benchmarks.operating.at_keys import DayError, Operator
from benchmarks.operating.calibrating import calibrate
from benchmarks.operating.place import Place
from benchmarks.operating.preparing import STOP_WITHIN

READY = r"All \d+ checks done.*Press F5 to start"
HOLDS = r"hold [+-][\d.]+"
ENDED = r"COMPLETED|TRIPPED|ABORTED"
VERDICT = r"[✓?✗] (ADEQUATE|EXPLAINED|AMBIGUOUS|UNEXPLAINED) +"
DIAGNOSED = 420.0
"""s that a diagnosis may take on a busy machine."""


@dataclass
class Day:
    """One operator, his bench, and the campaign's folder once there is one."""

    operator: Operator
    place: Place
    thrusters: tuple[str, ...]
    options: str = ""
    """Of `rig run`."""
    measured_twice: str = ""
    """The thruster of the next sweep."""

    def chapter(self, title: str) -> None:
        self.operator.transcript.chapter(title)

    def check_a_port_that_is_gone(self) -> None:
        self.chapter("A device is unplugged: rig check says so, then it is plugged in")
        self.place.tell("fault", "thermometer", "pulled")
        self.operator.runs("rig check campaign.toml", "one sentence", "thermometer.*there is no such port", status=2)
        self.place.tell("clear", "thermometer")

    def edit(self) -> None:
        """Thrusters and levels; a value beyond the bench's limit on the way."""
        self.chapter("rig edit: the thrusters, and a level that the bench does not allow")
        here = self.operator
        here.types("rig edit campaign.toml", "the form, and its dry run", "rig edit", "holds")
        self._enters("thrusters ", "Up", ", ".join(self.thrusters), r"campaign +\d+:\d\d expected")
        self._enters("max ", "Down", "30", "PROBLEM.*30")
        self._enters("max ", "Down", "16", r"peak voltage\D+16")
        self._enters("levels ", "Down", "2", r"2 at 8 V.*; 1 at 16 V", "not saved")
        here.presses("C-s", "saved", r"\[saved\]")
        here.presses("C-q", "back at the shell", r"\$\s*\Z")
        text = (self.place.folder / "campaign.toml").read_text(encoding="utf-8")
        read = tomllib.loads(text)
        if (read["campaign"]["thrusters"], read["plan"]["levels"]) != (list(self.thrusters), 2):
            raise DayError(f"the campaign file is not as it was typed:\n{text}")
        here.runs("rig check campaign.toml", "it may run", r"peak voltage\D+16", "holds")

    def _enters(self, field_name: str, way: str, value: str, *wanted: str) -> None:
        """A value in the place of what a field of the form holds, and what the dry run says of it."""
        here = self.operator
        here.goes_to(field_name, way)
        here.window.press("C-u")
        here.window.type(value)
        keys = f"{way} ... C-u {value}"
        here.sees(f"{field_name.strip()} = {value}", rf"{field_name} +{re.escape(value)}", *wanted, keys=keys)

    def calibrate(self) -> None:
        """With dead weights, a wrong one once."""
        self.chapter("rig calibrate: weights by hand, once another than the screen says")
        calibrate(self.operator, self.place)

    def preflight(self) -> None:
        """With a cable that comes out while one looks on."""
        self.chapter("Preflight; the load cell's cable comes out, and is put back")
        here, begun = self.operator, time.monotonic_ns()
        command = f"rig run campaign.toml {self.options}".strip()
        here.types(f"clear; {command}; echo status=$?", "the preflight passes", READY, "load_cell calibration")
        self.place.tell("fault", "load_cell", "pulled")
        here.sees(
            "it is said, and the key that helps",
            "FAILED.*load_cell",
            r"checks FAILED",
            "r retry load_cell",
        )
        here.presses("F5", "refused, and why", "not started: load_cell", "FAILED")
        self.place.tell("clear", "load_cell")
        here.presses("r", "it is there again", READY)
        if self.place.driven(begun):
            raise DayError("the motor was driven before F5")
        here.transcript.fact("by the truth log: nothing was driven before F5")

    def first_thruster(self) -> None:
        """Note, pause, a step taken again, a bad point that is measured once more."""
        self.chapter(f"{self.thrusters[0]}: a note, a pause, a step taken again, a bad point")
        here, name = self.operator, self.thrusters[0]
        here.presses("F5", "the motor's own watchdog is proved first", "proving watchdog")
        here.sees("a hold", f"{name} {HOLDS}")
        self.place.until_driven()
        here.presses("4", "all events", "events of this run")
        here.presses("n", "a dialog for the note, the stop key on it", "Note for the recording", "STOP")
        here.types("weed on the guard", "it is among the events", "note.*weed on the guard")
        self._pause(name)
        here.presses("t", "the step begins anew", "is taken again from its beginning")
        held = re.search(HOLDS, here.window.screen())
        here.sees("it has been measured, the next level", rf"{name} hold (?!{re.escape(held[0][5:] if held else '?')})")
        here.presses("m", "its samples stay, no fit takes them", "marked bad by the operator: step")
        here.presses("b", "and is measured once more", "back to step .* on request")
        here.presses("1", "readings, events and plots", "live readings", "campaign +T")

    def _pause(self, name: str) -> None:
        here, pressed = self.operator, time.monotonic_ns()
        here.presses("p", "paused at once", "PAUSED at 0 V")
        self.place.zero_after(pressed, STOP_WITHIN)
        here.presses("r", "the step is taken again", "resumed: .*retaken", f"{name} {HOLDS}")
        self.place.until_driven()

    def stop(self) -> None:
        """F9 in a hold."""
        self.chapter("F9")
        here = self.operator
        self.place.until_driven()
        pressed = time.monotonic_ns()
        here.presses("F9", "stopped", "ABORTED.*stopped by console", "at rest")
        self.place.zero_after(pressed, STOP_WITHIN)
        here.presses("d", "the table, and how to go on", "to go on .*rig resume", "(?m)^status=1", within=120.0)

    def trip(self) -> None:
        """The load cell is lost while the second thruster turns."""
        name = self.thrusters[min(1, len(self.thrusters) - 1)]
        self.chapter(f"{name}: the load cell is lost while the propeller turns")
        here = self.operator
        here.sees("the next thruster", f"{name} {HOLDS}", within=120.0)
        self.place.until_driven()
        pulled = time.monotonic_ns()
        self.place.tell("fault", "load_cell", "pulled")
        here.sees("tripped, and why", "TRIPPED.*load_cell", "at rest", "Press d to leave", within=30.0)
        self.place.zero_after(pulled, 1.0)
        here.presses("d", "the table, the page, and how to go on", "to go on .*rig resume", "status=1", within=240.0)

    def resume(self) -> None:
        """First with the cable still out."""
        self.chapter("rig resume: the cable is still out, then it is in")
        here, folder = self.operator, self.place.campaign
        here.runs(f"rig resume {folder}", "refused", "load_cell.*there is no such port", status=2)
        self.place.tell("clear", "load_cell")
        here.types(f"clear; rig resume {folder}; echo status=$?", "the preflight, of what is left", READY)
        here.presses("F5", "on with it", "proving watchdog|tare")
        for _ in range(3):
            screen = here.sees("the end", ENDED, "at rest", within=240.0)
            if "this machine is busy" not in screen:
                break
            here.presses("d", "a machine that is busy has cut it", "to go on .*rig resume", within=240.0)
            here.types(f"clear; rig resume {folder}; echo status=$?", "on once more", READY)
            here.presses("F5", "on with it", "proving watchdog|tare")
        here.sees("completed", "COMPLETED", "at rest")
        self.place.until_still()

    def diagnose(self) -> None:
        """G, and from there S: the console closes, the next sweep's campaign opens."""
        self.chapter("g: what physics C V|V| leaves out; s: the next sweep")
        here = self.operator
        here.presses("g", "page 6, one recording after the other", "diagnosing T1")
        here.sees("all answers", "next +", gone="diagnosing", within=DIAGNOSED)
        here.pages_to("the last one", rf"{VERDICT}{self.thrusters[-1]}")
        screen = here.presses(
            "s", "whose sweep, and what comes then", "Run the next sweep", "press F5 there, not before"
        )
        offered = re.search(r"Run the sweep of (\w+)", screen)
        if offered is None:
            raise DayError(f"no sweep is offered:\n{screen}")
        here.presses("Down", "its button", "Run the sweep of")
        begun = time.monotonic_ns()
        here.presses("Enter", "table and page, then the next campaign's preflight", READY, within=300.0)
        self.measured_twice = offered[1]
        self._next_sweep(offered[1], begun)

    def _next_sweep(self, name: str, begun: int) -> None:
        """F5 in its preflight, to its end; diagnosed with the recording that proposed it."""
        self.chapter(f"The next sweep, of {name}: F5 in its preflight, to its end, diagnosed with the first")
        here = self.operator
        if self.place.driven(begun):
            raise DayError("the motor was driven before F5")
        here.transcript.fact("by the truth log: nothing was driven before F5")
        here.presses("F5", "it goes", f"{name} {HOLDS}")
        here.sees("completed", "COMPLETED", "at rest", within=400.0)
        here.presses("g", "both recordings together", rf"diagnosing {name}\S*\.h5 \+ {name}")
        here.sees("one answer", rf"{VERDICT}{name}", gone="diagnosing", within=DIAGNOSED)
        here.presses("d", "table, page, status 0", "report: ", r"(?m)^status=0", within=240.0)

    def report(self) -> None:
        """What the page at the end of the campaign says."""
        self.chapter("The report")
        first = min((self.place.folder / "recordings").glob("first-2*"))
        text = (first / "report.html").read_text(encoding="utf-8")
        wanted = (
            *self.thrusters,
            "weed on the guard",
            "marked bad by the operator",
            "load_cell",
            "tripped",
            "A-2026-117",
        )
        missing = [word for word in wanted if word not in text]
        if missing:
            raise DayError(f"report.html does not have {missing}")
        self.operator.transcript.fact(f"report.html, {len(text)} characters, has {', '.join(wanted)}")

    def catalogue(self) -> None:
        """What was measured, and has the thruster with two campaigns changed?"""
        self.chapter("The catalogue: rig list, rig show, rig compare-fits")
        here, name = self.operator, self.measured_twice
        screen = here.runs("rig list recordings", "all recordings", *self.thrusters, "tripped", "completed")
        ids = re.findall(rf"(?m)^\S+ \S+ +([0-9a-f]{{8}}) +{name} ", screen)
        here.runs(f"rig show {ids[-1]} recordings | head -34", "all that is known of one", name, "thrust", "N")
        here.runs("rig list recordings --what campaigns", "the campaigns", "first", "next experiment")
        here.runs(
            "rig list recordings --what calibrations",
            "what they were measured under",
            r"gain_std 0\.0\d+ %, in 5 recordings",
        )
        compare = f"rig compare-fits --thruster {name} recordings"
        here.runs(compare, "has it changed?", "2 fits in order of time", rf"{name} has (not )?changed")
