"""`rig diagnose` beside the console, once nothing turns: its processor time would be the control loop's."""

from __future__ import annotations

import json
import sys
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import aclosing
from pathlib import Path
from typing import Any, Final

from rig.console.children import Child
from rig.console.leaving import LeavingApp
from rig.console.next_run import NextRun
from rig.console.panels import Panel
from rig.console.sweep_dialog import SweepDialog
from rig.console.view_model.answers import Answer, answer_of
from rig.console.view_model.answers_text import ASK, NOT_YET, answers_text
from rig.visible_text import visible

DIAGNOSE: Final = (sys.executable, "-m", "rig.diagnose.beside_console")
"""The command to which recordings are added."""
WRITE_NEXT: Final = (sys.executable, "-m", "rig.diagnose.next_from_answer")
"""The command to which the campaign and a folder are added."""
NO_SWEEP: Final = "No diagnosis here has proposed a sweep that can be run; g diagnoses."
WRITES: Final = "s writes it as a campaign, and says what to type."


class DiagnosisPanel(Panel):
    """The answers so far, and what goes on."""

    def on_mount(self) -> None:
        self.tell([], "", [], ASK)

    def tell(self, answers: Sequence[Answer], doing: str, written: Sequence[str], keys: str) -> None:
        self.put((tuple(answers), doing, tuple(written)), answers_text(answers, doing, written, keys))


class DiagnosingApp(LeavingApp, inherit_bindings=False):
    """The part of the console that diagnoses, and makes the next sweep a campaign. It starts no run."""

    diagnose: Sequence[str]
    """The command to which recordings are added."""
    begins: bool
    """Whoever opened this console begins the campaign that it leaves in `next_run`."""
    earlier: Sequence[str]
    """Recordings that are diagnosed together with each of this campaign's."""
    answers: tuple[Answer, ...] = ()
    doing: str = ""
    written: tuple[str, ...] = ()
    next_run: NextRun | None = None
    _child: Child | None = None
    _ends_early: bool = False
    _bodies: tuple[Mapping[str, Any], ...] = ()
    """`thruster-rig-diagnosis` of each answer, as it came."""

    @abstractmethod
    def action_view(self, name: str) -> None:
        """Show that page."""

    def action_diagnose(self) -> None:
        """G: not while anything may turn, and one at a time."""
        if not self.ended:
            self.notify(NOT_YET, severity="warning")
            return
        self.action_view("diagnosis")
        if self.doing:
            self.notify("A diagnosis is under way. Escape ends it.", severity="warning")
        else:
            self.answers, self._bodies, self._ends_early = (), (), False
            self.run_worker(self._diagnose(), group="diagnose", exclusive=True)

    def action_interrupt(self) -> None:
        """Escape: the diagnosis under way ends with what it has, pressed again at once; further ones are not begun."""
        if self._child is not None:
            self._child.interrupt()
            self._ends_early = True
            self.notify("It ends with what it has. Escape again ends it at once.")

    async def action_next_sweep(self) -> None:
        """S: asks for the next sweep of a diagnosis. Not while anything may turn."""
        offered = [k for k, answer in enumerate(self.answers) if answer.runs]
        if self.only_looks_on():
            return
        if not self.ended or not offered:
            self.notify(NO_SWEEP if self.ended else NOT_YET, severity="warning")
            return
        answers = [self.answers[k] for k in offered]

        def chosen(place: int | None) -> None:
            if place is not None:
                self.run_worker(self._write(offered[place]), group="next sweep", exclusive=True)

        await self.push_screen(SweepDialog(answers, begins=self.begins), chosen)
        self.call_after_refresh(self.show_text)

    async def end_diagnosis(self) -> None:
        """Whatever goes on for this page ends."""
        if self._child is not None:
            await self._child.end()

    async def _diagnose(self) -> None:
        files = self.state.snapshot.files if self.state.snapshot is not None else ()
        if not files:
            self.tell_of("no recording was made")
        for file in files:
            if not self._ends_early:
                await self._diagnose_file((*self.earlier, file))
        if files:
            self.tell_of("")
        self.doing = ""

    async def _diagnose_file(self, files: tuple[str, ...]) -> None:
        names = " + ".join(Path(file).name for file in files)
        self.tell_of(f"diagnosing {names} ...")
        self._child = Child([*self.diagnose, *files])
        try:
            async with aclosing(self._child.said()) as said:
                async for message in said:
                    if "at" in message:
                        self.tell_of(f"diagnosing {names}: {visible(str(message['at']))}   (Escape ends it)")
                    else:
                        self.answers += (answer_of(files, message),)
                        self._bodies += (message.get("answer", {}),)
        finally:
            self._child = None
            self.tell_of(self.doing)

    async def _write(self, place: int) -> None:
        """The sweep becomes a campaign; then this console ends for it, or says what to type."""
        answer = self.answers[place]
        folder = Path(answer.files[-1]).parent
        self.notify("writing the campaign ...", timeout=2.0)
        child = Child([*WRITE_NEXT, answer.campaign, str(folder)])
        async with aclosing(child.said(json.dumps(self._bodies[place]))) as said:
            message = await anext(said, {"fault": "nothing was written"})
        if "fault" in message:
            text = visible(str(message["fault"]))
            self.notify(text, title="not written", severity="error", timeout=10.0, markup=False)
            return
        first, *others = (Path(file) for file in message["files"])
        self.next_run = NextRun(first, answer.files, tuple(others))
        typed = "; then ".join(f"rig run {file}" for file in (first, *others))
        self.written += (f"written: {visible(f'{first}; type: {typed}')}",)
        self.tell_of(self.doing)
        if self.begins:
            self.exit()

    def tell_of(self, doing: str) -> None:
        """Show the answers so far, and what goes on; empty: nothing does."""
        self.doing = doing
        keys = ASK if self.begins else WRITES
        for panel in self.screen_stack[0].query(DiagnosisPanel) if self.screen_stack else ():
            panel.tell(self.answers, doing, self.written, keys)
