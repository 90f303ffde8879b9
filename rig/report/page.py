"""One self-contained HTML page: title, a lead sentence, sections of sentences, tables and pictures.

Nothing is fetched: style and pictures are in the file, there is no script, and a content security policy in the page
says so to the browser. Every text is escaped by the template. The same page gives the same bytes.

>>> page = Page("Fit of <T1>", "All is well.", (Section("Found", (Sentences(("C = 0.4 N/V^2",)),)),))
>>> "Fit of &lt;T1&gt;" in html(page)
True
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Literal, TypeAlias

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from rig.report.style import PALETTE, WIDE, Plot, svg
from rig.visible_text import visible

HERE = Path(__file__).parent
Tone = Literal["", "good", "doubt", "bad"]


@dataclass(frozen=True, slots=True)
class Remark:
    """A sentence with a sign before it: check mark, question mark or cross; none for the plain tone."""

    text: str
    tone: Tone = ""


@dataclass(frozen=True, slots=True)
class Sentences:
    """A list of sentences."""

    items: tuple[str | Remark, ...]
    kind: str = "sentences"

    @property
    def remarks(self) -> tuple[Remark, ...]:
        return tuple(item if isinstance(item, Remark) else Remark(item) for item in self.items)


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text. `words`: numbers of the columns that hold words; the others are numbers, right-aligned.

    On a phone a row becomes a card; a `folded` table (long) stays closed until it is asked for, and scrolls.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: frozenset[int] = frozenset({0})
    folded: bool = False
    kind: str = "table"

    def __post_init__(self) -> None:
        wrong = [row for row in self.rows if len(row) != len(self.head)]
        if wrong:
            raise ValueError(f"table {self.caption!r}: row {wrong[0]} has not the {len(self.head)} cells of its head")


@dataclass(frozen=True, slots=True)
class Listing:
    """Lines to be copied as they are."""

    caption: str
    lines: tuple[str, ...]
    kind: str = "listing"


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure with its title and a caption that says what to look for."""

    title: str
    plot: Plot
    caption: str = ""
    kind: str = "picture"

    @property
    def narrow(self) -> str:
        return svg(self.plot)

    @property
    def wide(self) -> str:
        """Empty when one size does."""
        return svg(self.plot, self.plot.wide) if self.plot.wide else ""

    @property
    def spans(self) -> bool:
        """Takes the whole width of a desk page."""
        return self.plot.wide is not None and self.plot.wide[0] >= WIDE[0]


@dataclass(frozen=True, slots=True)
class Verbatim:
    """A text as it is, line by line, such as a configuration file; closed on a screen until it is asked for."""

    caption: str
    text: str
    kind: str = "verbatim"


@dataclass(frozen=True, slots=True)
class Blanks:
    """Lines to be filled in by hand on paper. `fields`: what belongs on each."""

    fields: tuple[str, ...]
    kind: str = "blanks"


@dataclass(frozen=True, eq=False)
class Section:
    """A heading, a sentence under it, and what belongs to it; sections may hold sections."""

    title: str
    parts: tuple[Part, ...]
    lead: str = ""
    kind: str = "section"

    @property
    def anchor(self) -> str:
        """For links within the page: letters and digits of the title.

        >>> Section("T1: what <was> found", ()).anchor
        't1-what-was-found'
        """
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-") or "section"


Part: TypeAlias = Section | Sentences | Table | Listing | Picture | Verbatim | Blanks


@dataclass(frozen=True, eq=False)
class Page:
    """All of a report. `lead`: the one sentence that a reader in a hurry takes away."""

    title: str
    lead: str
    sections: tuple[Section, ...]
    contents: bool = False
    """Show links to the sections at the top."""


@cache
def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["coded"] = _coded
    return environment.get_template("page.html.jinja")


def _coded(text: str) -> Markup:
    """A sentence, escaped, with what stands between backticks as code: what can be typed.

    >>> str(_coded("<b>, type `rig fit <FILE>`"))
    '&lt;b&gt;, type <code>rig fit &lt;FILE&gt;</code>'
    """
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))  # noqa: S704 - escaped in this line


def html(page: Page) -> str:
    """The whole page as text."""
    numbers = count(1)

    def drawn(text: str) -> str:
        """An SVG of ours with ids that no other on the page has."""
        prefix = f"f{next(numbers)}-"
        return re.sub(r'( id="|href="#|url\(#)', lambda found: found[1] + prefix, text)

    style = (HERE / "page.css").read_text(encoding="utf-8")
    anchors = _anchors(page)
    known = {"palette": PALETTE, "style": style, "drawn": drawn, "program": program()}
    return visible(_template().render(page=page, anchor=lambda part: anchors[id(part)], **known)) + "\n"


def _anchors(page: Page) -> dict[int, str]:
    """Of each section by its `id()`: its anchor, numbered where an earlier one has the same title."""
    found: dict[int, str] = {}

    def walk(sections: Iterable[object]) -> None:
        for section in sections:
            if isinstance(section, Section):
                taken, name = set(found.values()), section.anchor
                more = (f"{name}-{i}" for i in count(2))
                found[id(section)] = name if name not in taken else next(each for each in more if each not in taken)
                walk(section.parts)

    walk(page.sections)
    return found


def write(page: Page, path: Path) -> None:
    """To a file, whose folder is made if need be. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(html(page), encoding="utf-8", newline="\n")


def program() -> str:
    """Name and version, as the foot of each page has it."""
    return f"thruster-rig {version('thruster-rig')}"


def sentences(items: Iterable[str | Remark]) -> tuple[Sentences, ...]:
    """One list, or nothing for none: to be unpacked into the parts of a section."""
    found = tuple(items)
    return (Sentences(found),) if found else ()


def columns(head: Sequence[str], *words: str) -> frozenset[int]:
    """Numbers of the columns called `words`, for `Table.words`.

    >>> sorted(columns(("name", "value", "unit"), "name", "unit"))
    [0, 2]
    """
    return frozenset(head.index(word) for word in words)
