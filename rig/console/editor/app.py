"""The editor: keys go into the form, the form into the draft, the draft's text to who assesses it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from typing import ClassVar, Final

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.filter import LineFilter
from textual.timer import Timer
from textual.widget import Widget
from textual.widgets import Input, Static

from rig.console.editor.form import Choice, Form, Row
from rig.console.editor.preview import CommandPlot, Numbers, Problem
from rig.console.editor.questions import Keys, Question
from rig.console.few_colors import filters_for
from rig.console.keys_in_order import KeysInOrder
from rig.dry_run.outlook import Assessment
from rig.editing.draft import Draft
from rig.editing.fields import Field
from rig.editing.saving import ChangedOnDiskError
from rig.errors import ConfigError
from rig.visible_text import visible

QUIET: Final = 0.2
"""s without a change after which the dry run is made again."""
BOTTOM: Final = "Ctrl+S save  Ctrl+Z undo  Tab next field  F1 keys  Ctrl+Q leave"


class EditorApp(App[None], inherit_bindings=False):
    """One campaign file."""

    CSS_PATH = "editor.tcss"
    TITLE = "rig edit"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "save", "save"),
        Binding("ctrl+z", "undo", "undo"),
        Binding("ctrl+q,escape", "leave", "leave"),
        Binding("ctrl+c,super+c", "leave", "leave", priority=True),
        Binding("f1,question_mark", "help", "keys"),
        Binding("f9", "no_stop", "no run"),
        Binding("tab,down", "app.focus_next", "next"),
        Binding("shift+tab,up", "app.focus_previous", "previous"),
        Binding("pagedown", "scroll(1)", "down"),
        Binding("pageup", "scroll(-1)", "up"),
    ]

    def __init__(self, draft: Draft, assess: Callable[[str], Assessment], *, colors: str = "full") -> None:
        """`assess` says what a text would be as this campaign file; `colors`: `full`, `16` or `none`."""
        super().__init__()
        self.HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide")]
        self.draft, self.assess = draft, assess
        self.terminal_colors = colors
        self.keys = KeysInOrder(self)
        self.set_class(colors != "full", "-few-colors")
        self.found = Assessment()
        self.entered: Row | None = None
        """The row that is typed into."""
        self._due: Timer | None = None

    def compose(self) -> ComposeResult:
        yield Static(id="head", markup=False)
        with Horizontal(id="both"):
            yield Form(id="form")
            with VerticalScroll(id="preview"):
                yield Problem(id="problem", markup=False)
                yield CommandPlot()
                yield Numbers(id="numbers")
        yield Static(BOTTOM, id="keys", markup=False)

    def on_mount(self) -> None:
        self.form = self.query_one(Form)
        self.form.load(self.draft.document, anew=True)
        self.look()
        self.form.focus_first()

    def get_line_filters(self) -> Sequence[LineFilter]:
        return filters_for(self.terminal_colors, super().get_line_filters())

    def on_resize(self) -> None:
        self.call_after_refresh(self._draw)

    async def on_event(self, event: events.Event) -> None:
        await self.keys.handle(event, super().on_event)

    # ---- from the form into the draft

    def on_input_changed(self, event: Input.Changed) -> None:
        self._gather(self.form.row_of(event.input))

    def on_choice_changed(self, event: Choice.Changed) -> None:
        self._gather(self.form.row_of(event.choice))

    def on_descendant_focus(self, event: events.DescendantFocus) -> None:
        """A field is left when another is entered: what was typed there is done."""
        self._gather(self.form.row_of(event.widget))

    def _gather(self, row: Row | None) -> None:
        """Take what stands in a row now, which may be more than what its message said."""
        if row is None:
            return
        before = self.draft.document
        if row is not self.entered:
            self._leave_row()
            self.entered = row
        self._type(row)
        self.form.load(self.draft.document, besides=(row.control, self._focused))
        if self.draft.document.text != before.text:
            self._tell_head()
            self._soon()

    def _leave_row(self) -> None:
        """The last word of the row that was typed into; then it shows its value as the file has it."""
        if self.entered is not None:
            self._type(self.entered)
            self.draft.settle()
            if self.entered.control is self._focused:  # keys may be on their way to it
                self.entered.shown = self.entered.typed
            else:
                self.entered.load(self.draft.document)
        self.entered = None

    def _type(self, row: Row) -> None:
        try:
            self.draft.type(row.field, row.typed, row.shown)
        except ConfigError as error:
            self.notify(str(error), severity="error", markup=False)

    @property
    def _focused(self) -> Widget | None:
        """In the form, also under a dialog."""
        return self.screen_stack[0].focused

    def _gather_all(self) -> None:
        """Before anything is done with the whole: no key that has reached a field is left out."""
        for row in self.form.pending():
            self._gather(row)

    # ---- the dry run

    def _soon(self) -> None:
        if self._due is not None:
            self._due.stop()
        self._due = self.set_timer(QUIET, self.look)

    @property
    def _standing(self) -> bool:
        """False while the application closes: its widgets go before its timers."""
        return bool(self.screen_stack) and len(self.screen_stack[0].query("#head, #keys")) == 2

    def look(self) -> None:
        """Make the dry run of what stands now, and show it."""
        if not self._standing:
            return
        self.found = self.assess(self.draft.document.text)
        wrong = self._faults()
        first = next(iter(wrong.values()), "")
        if first and not self.found.problem:
            self.found = Assessment(self.found.steps, problem=first)
        for row in self.form.rows():
            row.mark(row.field in wrong)
        self._tell_head()
        self._draw()

    def _faults(self) -> dict[Field, str]:
        """Fields that hold what the loader does not take, each with its sentence."""
        document, path = self.draft.document, self.draft.file.path
        found = {}
        for row in self.form.rows():
            sentence = row.field.fault(document, path).removeprefix(f"{path}: ")
            if sentence or (row.display and _names(self.found.problem, row.field)):
                found[row.field] = sentence or self.found.problem
        return found

    def _draw(self) -> None:
        if self._standing:
            base = self.screen_stack[0]  # under a dialog too
            base.query_one(Problem).show(self.found)
            base.query_one(Numbers).show(self.found)
            base.query_one(CommandPlot).show(self.found.steps)

    def _tell_head(self) -> None:
        state = "not saved" if self.draft.unsaved else "saved"
        if self.found.problem:
            state += ", can't run yet"
        head = self.screen_stack[0].query_one("#head", Static)
        head.update(f"rig edit  {visible(str(self.draft.file.path))}  [{state}]")

    # ---- what keys do

    def action_save(self) -> None:
        if len(self.screen_stack) > 1:
            return
        self._gather_all()
        self.look()
        if self.found.problem:
            answers = (("stay", "Go on editing"), ("anyway", "Save all the same"))
            text = f"{visible(self.found.problem)}\n\n`rig run` will refuse this file until that is put right."
            self.push_screen(Question("It can't run yet. Save it?", text, answers), self._save_unready)
        else:
            self._save()

    def _save_unready(self, answer: str | None) -> None:
        if answer == "anyway":
            self._save()

    def _save(self, *, anyway: bool = False, leave: bool = False) -> None:
        try:
            self.draft.save(anyway=anyway)
        except ChangedOnDiskError as error:
            answers = (("stay", "Go on editing"), ("load", "Load it from the disk"), ("overwrite", "Overwrite it"))
            self.push_screen(Question("Changed on the disk", visible(str(error)), answers), self._settle_change)
            return
        except ConfigError as error:
            self.notify(str(error), title="Not saved", severity="error", timeout=10.0, markup=False)
            return
        if leave:
            self.exit()
            return
        self._leave_row()
        self._tell_head()
        if not self.found.problem:
            self.notify(f"saved; to run it: rig run {shlex.quote(str(self.draft.file.path))}", markup=False)

    def _settle_change(self, answer: str | None) -> None:
        if answer == "overwrite":
            self._save(anyway=True)
        elif answer == "load":
            try:
                self.draft.load_again()
            except ConfigError as error:
                self.notify(str(error), title="Not loaded", severity="error", timeout=10.0, markup=False)
                return
            self._show_document()

    def _show_document(self) -> None:
        """All fields anew, the focused one too: what was typed into it is in the draft."""
        self.entered = None
        self.form.load(self.draft.document, anew=True)
        self.look()

    def action_undo(self) -> None:
        if len(self.screen_stack) > 1:
            return
        self._gather_all()
        if self.draft.undo():
            self._show_document()
        else:
            self.notify("Nothing to undo.", timeout=2.0)

    def action_leave(self) -> None:
        if len(self.screen_stack) > 1:
            return  # a dialog is open: Escape first
        self._gather_all()
        if not self.draft.unsaved:
            self.exit()
            return
        answers = (("stay", "Go on editing"), ("save", "Save and leave"), ("drop", "Leave without saving"))
        text = f"{visible(str(self.draft.file.path))} has changes that are not saved."
        self.look()
        if self.found.problem:
            text += f"\nIt can't run yet: {visible(self.found.problem)}"
        self.push_screen(Question("Leave the editor?", text, answers), self._leave)

    def _leave(self, answer: str | None) -> None:
        if answer == "save":
            self._save(leave=True)
        elif answer == "drop":
            self.exit()

    def action_help(self) -> None:
        if len(self.screen_stack) == 1:
            self.push_screen(Keys())

    def action_no_stop(self) -> None:
        """Somebody wants a motor to stop that another program turns."""
        self.notify("NOT STOPPED: the editor drives nothing. Stop in the console, or type: rig stop", severity="error")

    def action_scroll(self, pages: int) -> None:
        self.form.scroll_relative(y=pages * max(1, self.form.size.height - 2), animate=False)


def _names(problem: str, field: Field) -> bool:
    """Whether a sentence of the loader is about this key: by its whole name, or by its own first after its table's."""
    if re.search(rf"(?<![\w.]){re.escape(field.dotted)}(?![\w.])", problem):
        return True
    table, _, rest = problem.partition("]: ")
    named = rest.partition(" ")[0].split(".")
    inside = (*table.removeprefix("[").split("."), *named) if rest else ()
    own = field.key
    return inside in (own, (*own[:-1], *own[-2:]))  # [plan.dwell]: dwell.settle
