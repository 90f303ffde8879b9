"""The wizard of `rig calibrate`: it shows what goes on, and sends what the operator answers. It measures nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar, Final

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.filter import LineFilter
from textual.widgets import Static

from rig.console.editor.questions import Question
from rig.console.few_colors import filters_for
from rig.console.weighing.dialogs import Keys, Typed
from rig.console.weighing.shown import HEAD, Weighing, instruction, keys_of, live, progress, table
from rig.visible_text import visible

PERIOD: Final = 0.1
"""s between two looks at what is to be shown."""
PLUS: Final = "+"
"""Between the names of weights that hang together."""


class WeighingApp(App[None], inherit_bindings=False):
    """One calibration, in which somebody hangs weights."""

    CSS_PATH = "weighing.tcss"
    TITLE = "rig calibrate"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "go", "it hangs"),
        Binding("e", "other", "other weights"),
        Binding("r", "again", "again"),
        Binding("b", "earlier", "back"),
        Binding("s", "skip", "leave out"),
        Binding("o", "probable", "it was"),
        Binding("k", "keep", "keep"),
        Binding("question_mark,f1", "help", "keys"),
        Binding("q,escape", "end", "end"),
        Binding("ctrl+c,super+c", "end", "end", priority=True),
        Binding("up", "scroll(-1)", "up"),
        Binding("down", "scroll(1)", "down"),
    ]

    def __init__(
        self, shown: Callable[[], Weighing], answer: Callable[[str], None], *, colors: str = "full", bell: bool = True
    ) -> None:
        """`shown`: what there is to show now; `answer`: takes `go`, `again`, `keep`, `probable`, `skip`, `stop`,
        `back N` (from 1) and `hung NAME + NAME`."""
        super().__init__()
        self.HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide")]
        self.shown, self.answer = shown, answer
        self.terminal_colors, self.rings = colors, bell
        self.set_class(colors != "full", "-few-colors")
        self.now = shown()

    def compose(self) -> ComposeResult:
        yield Static(id="head", markup=False)
        yield Static(id="do", markup=False)
        yield Static(id="live", markup=False)
        yield Static(id="table", markup=False)
        yield Static(id="said", markup=False)
        with VerticalScroll(id="result"):
            yield Static(id="lines", markup=False)
        yield Static(id="keys", markup=False)

    def on_mount(self) -> None:
        self.look()
        self.set_interval(PERIOD, self.look)

    def get_line_filters(self) -> Sequence[LineFilter]:
        return filters_for(self.terminal_colors, super().get_line_filters())

    def look(self) -> None:
        """Show what goes on now; ring when somebody is asked."""
        before, self.now = self.now, self.shown()
        if not self.screen_stack or not self.screen_stack[0].query("#keys"):
            return  # it closes
        if self.now.leaves:
            self.exit()
        base = self.screen_stack[0]
        now = self.now
        asked = now.asks or now.doubt
        if self.rings and asked and asked != (before.asks or before.doubt):
            self.bell()
        base.set_class(now.ended, "-ended")
        base.query_one("#head", Static).update(visible(f"{now.title}  {progress(now.steps)}"))
        do = base.query_one("#do", Static)
        do.set_class(bool(now.doubt) or now.failed, "doubt")
        do.set_class(now.ended and not now.failed, "done")
        do.update(visible(instruction(now)))
        base.query_one("#live", Static).set_class(now.ended, "gone").update(visible(live(now)))
        rows = base.query_one("#table", Static)
        rows.update(visible("\n".join((HEAD, *table(now, max(rows.size.height - 2, 3))))))
        base.query_one("#said", Static).update(visible("\n".join(now.said[-8 if self.size.width >= 110 else -3 :])))
        base.query_one("#lines", Static).update(visible("\n".join(now.result)))
        base.query_one("#keys", Static).update(visible(keys_of(now)))

    # ---- what keys do

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """A key that has no meaning now does nothing; under a dialog none of ours has."""
        del parameters
        if len(self.screen_stack) > 1:
            return action not in OURS
        match action:
            case "go" | "other" | "earlier" | "skip":
                return bool(self.now.asks)
            case "again":
                return bool(self.now.asks or self.now.doubt)
            case "probable":
                return bool(self.now.doubt and self.now.probable)
            case "keep":
                return bool(self.now.doubt)
        return True

    def action_go(self) -> None:
        self.answer("go")

    def action_again(self) -> None:
        self.answer("again")

    def action_keep(self) -> None:
        self.answer("keep")

    def action_probable(self) -> None:
        self.answer("probable")

    def action_skip(self) -> None:
        self.answer("skip")

    def action_help(self) -> None:
        self.push_screen(Keys())

    def action_other(self) -> None:
        hint = f"names of the set, with {PLUS} between them: {', '.join(self.now.weights)}; - for no load"
        dialog = Typed(f"Step {self.now.at + 1}: which weights hang?", hint, self._no_weights)
        self.push_screen(dialog, lambda typed: self.answer(f"hung {typed}") if typed else None)

    def _no_weights(self, typed: str) -> str:
        names = [name.strip() for name in typed.split(PLUS)]
        if names == ["-"]:
            return ""
        unknown = [name for name in names if name not in self.now.weights]
        if unknown:
            return f"{unknown[0] or 'an empty name'!r} is none of {', '.join(self.now.weights)}"
        return "a weight hangs once only" if len(set(names)) < len(names) else ""

    def action_earlier(self) -> None:
        read = [step.number for step in self.now.steps if step.state in ("read", "kept")]
        if not read:
            self.bell()
            return

        def fault(typed: str) -> str:
            return (
                ""
                if typed.strip().isdecimal() and int(typed) in read
                else f"expected one of {', '.join(map(str, read))}"
            )

        dialog = Typed(
            "Back to which step?", "its number: it is hung and read again, then the plan goes on here", fault
        )
        self.push_screen(dialog, lambda typed: self.answer(f"back {typed.strip()}") if typed else None)

    def action_end(self) -> None:
        if self.now.ended:
            self.exit()
        elif len(self.screen_stack) > 1:
            self.pop_screen()
        else:
            question = Question(
                "End without a calibration?",
                "What was read stays in the recording, which says that the calibration did not come to its end.",
                (("stay", "go on"), ("end", "end")),
            )
            self.push_screen(question, lambda said: self.answer("stop") if said == "end" else None)

    def action_scroll(self, by: int) -> None:
        self.screen_stack[0].query_one("#result", VerticalScroll).scroll_relative(y=by, animate=False)


OURS: Final = frozenset({"go", "other", "again", "earlier", "skip", "probable", "keep", "help", "scroll"})
