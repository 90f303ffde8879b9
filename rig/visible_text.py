r"""What stands in files, on wires and in names is shown, never obeyed: control characters, escape sequences and marks
that turn the direction of writing become `\u001b` and the like, as JSON writes them, before a terminal or a page has
them.

All that the commands print goes through `visible_output`, tables through `console`, pages and snapshots through
`visible` itself.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TextIO, TypeVar

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderResult

T = TypeVar("T")

HIDDEN: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # C0 but tab and line feed, DEL, C1: ECMA-48 begins all its sequences with these
    "\u00ad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"  # bidi (UAX #9), invisible
    "\ud800-\udfff\U0001d173-\U0001d17a\U000e0000-\U000e007f]"  # lone surrogates, musical controls, tags
)


def visible(text: str) -> str:
    r"""`text` with every character that a terminal obeys or nobody sees written out. JSON stays the same JSON.

    >>> visible("T1 \x1b]0;title\x07, \u202egnp.exe")
    'T1 \\u001b]0;title\\u0007, \\u202egnp.exe'
    """
    return text if text.isprintable() else HIDDEN.sub(_written_out, text)


def _written_out(found: re.Match[str]) -> str:
    units = found[0].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[i : i + 2].hex()}" for i in range(0, len(units), 2))


def visible_texts(value: T) -> T:
    """A message with all of its texts made visible, through its dataclasses, tuples and dicts."""
    if isinstance(value, str):
        return visible(value)  # type: ignore[return-value]  # of a str a str
    if isinstance(value, tuple):
        return tuple(visible_texts(item) for item in value)  # type: ignore[return-value]  # of a tuple a tuple
    if is_dataclass(value) and not isinstance(value, type):
        changed = {field.name: visible_texts(getattr(value, field.name)) for field in fields(value)}
        return replace(value, **changed)
    return value


class VisibleStream:
    """A text stream that makes what is written to it visible; everything else is the stream's own."""

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream
        """Where rich writes, which has escape sequences of its own: see `console`."""

    def write(self, text: str) -> int:
        self.rich_proxied_file.write(visible(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":  # whoever found it would write past `write`
            raise AttributeError(name)
        return getattr(self.rich_proxied_file, name)


@contextlib.contextmanager
def visible_output() -> Iterator[None]:
    """Standard output and error of this process are visible streams."""
    with (
        contextlib.redirect_stdout(VisibleStream(sys.stdout)),
        contextlib.redirect_stderr(VisibleStream(sys.stderr)),
    ):
        yield


def unfiltered(stream: TextIO) -> TextIO:
    """The stream itself, for a line that a program of ours draws over."""
    return stream.rich_proxied_file if isinstance(stream, VisibleStream) else stream


class _Visible:
    """Something for rich to draw, whose texts are visible when it is drawn."""

    def __init__(self, drawn: ConsoleRenderable) -> None:
        self._drawn = drawn

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.segment import Segment

        for segment in console.render(self._drawn, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


class _Hook:
    """Asked by rich before it draws anything."""

    def process_renderables(self, renderables: Sequence[ConsoleRenderable]) -> list[ConsoleRenderable]:
        return [_Visible(drawn) for drawn in renderables]


def console(**options: Any) -> Console:
    """A rich console for texts that are no markup. Takes the options of `rich.console.Console`. What a bar of progress
    says beside itself is drawn past it: that is made visible where it is set."""
    from rich.console import Console

    made = Console(markup=False, emoji=False, **options)
    made.push_render_hook(_Hook())  # type: ignore[arg-type]  # rich asks for a subclass, and calls one method
    return made
