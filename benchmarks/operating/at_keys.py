"""Somebody who has only keys, and looks at the screen after each; all of it is written down."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.operating.tmux import Window

PATIENCE = 60.0
"""s for the screen to show what it has to, on a busy machine."""
SLOW = 1.5
"""s in which a cursor moves, on a busy machine."""
LOOK = 0.1
"""s between looks at the screen."""


class DayError(Exception):
    """The screen, or the motor, was not as it has to be."""


@dataclass
class Transcript:
    """A text file that grows with each key; and how many things were looked for and found."""

    path: Path
    begun: float = field(default_factory=time.monotonic)
    found: int = 0

    def write(self, text: str) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write(text + "\n")

    def chapter(self, title: str) -> None:
        self.write(f"\n{'=' * 120}\n{self.clock()} {title}\n{'=' * 120}")
        print(f"{self.clock()} {title}", flush=True)

    def clock(self) -> str:
        minutes, seconds = divmod(time.monotonic() - self.begun, 60.0)
        return f"[{minutes:02.0f}:{seconds:04.1f}]"

    def step(self, who: str, keys: str, says: str, wanted: Sequence[str], screen: str) -> None:
        """A key, what it had to lead to, and what stands there."""
        self.found += len(wanted)
        saw = "".join(f"\n    saw: {text}" for text in wanted)
        rule = "-" * 120
        self.write(f"\n{self.clock()} {who}: {keys or '(looks)'}  -- {says}{saw}\n{rule}\n{screen.rstrip()}\n{rule}")

    def fact(self, text: str) -> None:
        """Something that was looked for elsewhere than on the screen, and found."""
        self.found += 1
        self.write(f"{self.clock()} {text}")


@dataclass
class Operator:
    """At one terminal."""

    window: Window
    transcript: Transcript

    def sees(self, says: str, *wanted: str, within: float = PATIENCE, keys: str = "", gone: str = "") -> str:
        """Wait until all of `wanted` (regular expressions) stand on the screen, and `gone` does not; that screen."""

        def there(screen: str) -> bool:
            return all(re.search(text, screen) for text in wanted) and not (gone and re.search(gone, screen))

        return self._until(says, there, wanted, within, keys)

    def presses(self, key: str, says: str, *wanted: str, within: float = PATIENCE) -> str:
        """One key, and what the screen has to show then."""
        self.window.press(key)
        return self.sees(says, *wanted, within=within, keys=key)

    def types(self, letters: str, says: str, *wanted: str, within: float = PATIENCE) -> str:
        """Letters and Enter."""
        self.window.type(letters)
        self.window.press("Enter")
        return self.sees(says, *wanted, within=within, keys=f"{letters} Enter")

    def runs(self, command: str, says: str, *wanted: str, status: int = 0, within: float = PATIENCE) -> str:
        """A command to its end: its status, and what stands there. The screen is cleared before."""
        self.window.type(f"clear; {command}; echo status=$?")
        self.window.press("Enter")
        return self.sees(says, *wanted, rf"(?m)^status={status}\b", within=within, keys=f"{command} Enter")

    def pages_to(self, says: str, wanted: str, most: int = 10) -> str:
        """With the page key until it stands on the screen."""
        for _ in range(most):
            before = self.window.screen()
            if re.search(wanted, before):
                break
            self.window.press("PageDown")
            deadline = time.monotonic() + SLOW
            while self.window.screen() == before and time.monotonic() < deadline:
                time.sleep(LOOK)
        return self.sees(says, wanted, keys="PageDown", within=SLOW)

    def goes_to(self, field_name: str, key: str, most: int = 40) -> None:
        """With an arrow key until the cursor stands in that field of a form. Where it does not move within SLOW, the
        field is one without a cursor."""
        for _ in range(most):
            if field_name in (before := self.window.cursor_line()):
                return
            self.window.press(key)
            deadline = time.monotonic() + SLOW
            while self.window.cursor_line() == before and time.monotonic() < deadline:
                time.sleep(LOOK)
        raise DayError(f"no field {field_name!r} was reached:\n{self.window.screen()}")

    def _until(
        self,
        says: str,
        there: Callable[[str], bool],
        wanted: Sequence[str],
        within: float,
        keys: str,
    ) -> str:
        deadline = time.monotonic() + within
        while not there(screen := self.window.screen()):
            if time.monotonic() > deadline:
                missing = [text for text in wanted if not re.search(text, screen)]
                self.transcript.step(self.window.name, keys, f"NOT SHOWN within {within:g} s: {missing}", (), screen)
                raise DayError(f"{says}: not on the screen within {within:g} s: {missing}\n{screen}")
            time.sleep(LOOK)
        self.transcript.step(self.window.name, keys, says, wanted, screen)
        return screen
