"""What the frame of a widget says, set where it is another: Textual draws the whole widget again for each setting."""

from __future__ import annotations

from textual.widget import Widget


def entitle(widget: Widget, title: str, subtitle: str | None = None) -> None:
    """Texts without markup; `subtitle` None: it stays as it is."""
    if widget.border_title != title:
        widget.border_title = title
    if subtitle is not None and widget.border_subtitle != subtitle:
        widget.border_subtitle = subtitle
