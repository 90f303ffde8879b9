"""What each stage of a diagnosis handed on, as text: `rig diagnose --explain`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.mismatch.answer.explained.explain import Section

HEAD = "How it came to that, stage by stage (docs/method.md says what the figures mean)"


def explanation_text(sections: Sequence[Section]) -> str:
    """A heading with its number for each stage, and its figures under it."""
    parts = [HEAD]
    for number, section in enumerate(sections, 1):
        parts.append("\n".join([f"{number}. {section.title}", *(f"   {line}" for line in section.lines)]))
    return "\n\n".join(parts)
