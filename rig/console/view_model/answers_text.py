"""The diagnosis page: a paragraph for each part of each answer, the verdict first. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from rig.console.view_model.answers import Answer, sweep_text

STYLES: Final = {
    "adequate": "bold #7fd88f",
    "explained": "bold #7fd88f",
    "ambiguous": "bold #f0c040",
    "unexplained": "bold #ff9090",
    "": "bold #ff9090",
}
LABEL: Final = 9
"""Columns before the text of a part."""
NOT_YET: Final = "Once the campaign has ended, g diagnoses its recordings: what physics C V|V| leaves out."
ASK: Final = "s asks for it, shows what it does, and runs it."


def answers_text(answers: Sequence[Answer], doing: str, written: Sequence[str] = (), keys: str = ASK) -> Group:
    """`doing`: what goes on, above them; `written`: sentences on sweeps that were made campaigns; `keys`: what is said
    behind a sweep that can be run."""
    parts: list[RenderableType] = [Text(doing, "#b0b0b0"), Text()] if doing else []
    for answer in answers:
        parts += [_heading(answer), *([] if answer.fault else [_table(answer, keys)]), Text()]
    parts += [Text(line, "bold", overflow="fold") for line in written]
    if not doing and not answers:
        parts.append(Text(NOT_YET))
    return Group(*parts)


def _heading(answer: Answer) -> Text:
    names = " + ".join(Path(file).name for file in answer.files)
    text = Text()
    if answer.fault:
        text.append(f"{answer.mark} NO ANSWER", STYLES[""]).append(f"   {names}: {answer.fault}")
        return text
    told = "" if answer.headline == answer.verdict else answer.headline.removeprefix(answer.verdict).lstrip(" :")
    text.append(f"{answer.mark} {answer.verdict.upper()}", STYLES.get(answer.verdict, "bold"))
    return (
        text.append(f"   {answer.thruster}".rstrip(), "bold").append(f"   {names}").append(f"\n{told}" if told else "")
    )


def _table(answer: Answer, keys: str) -> RenderableType:
    table = Table.grid(padding=(0, 1))
    table.add_column(width=LABEL, no_wrap=True)
    table.add_column(ratio=1, overflow="fold")
    for label, text in _rows(answer, keys):
        table.add_row(Text(label, "#b0b0b0"), text)
    return Padding(table, (0, 0, 0, 2))


def _rows(answer: Answer, keys: str) -> Iterator[tuple[str, Text]]:
    yield "verdict", Text(answer.statement)
    for k, where in enumerate(answer.where):
        yield "" if k else "where", Text(where)
    for k, effect in enumerate(answer.what):
        text = Text("", "").append(effect.name, "bold")
        text.append(f": {', '.join(effect.values)}" if effect.values else "")
        yield "" if k else "what", text
        if effect.says not in answer.statement:
            yield "", Text(effect.says)
        if effect.earned:
            yield "", Text(effect.earned)
        if effect.rivals:
            yield "", Text("or: " + ", ".join(effect.rivals))
    if answer.error:
        yield "error", Text(f"on what was not fitted: {answer.error}")
    yield "left", Text(answer.left or "nothing that these data show")
    yield from _next(answer, keys)
    for k, note in enumerate(answer.notes):
        yield "" if k else "notes", Text(note)


def _next(answer: Answer, keys: str) -> Iterator[tuple[str, Text]]:
    if answer.sweep is None:
        none = "none is proposed: nothing that was named has a rival"
        yield "next", Text(f"no sweep settles it: {answer.hopeless}" if answer.hopeless else none)
        return
    yield "next", Text("").append(sweep_text(answer.sweep), "bold")
    yield "", Text(answer.sweep.why)
    if answer.runs:
        yield "", Text(keys)
    else:
        yield "", Text(answer.no_sweep or "a campaign is driven in V: this one can't be run from here")
