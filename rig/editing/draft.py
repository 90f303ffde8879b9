"""A document while a person edits it: what stands now, what stood before, what is on the disk."""

from __future__ import annotations

from rig.editing.document import Document, require_toml
from rig.editing.fields import Field, changed
from rig.editing.saving import Opened, opened, saved


class Draft:
    """Typing into one field is one change, made to what stood when the field was entered: a value that is emptied and
    typed anew keeps its place and its comment, and is undone at once."""

    def __init__(self, file: Opened) -> None:
        """Raises ConfigError for a file that is no TOML."""
        require_toml(file.path, file.text)
        self.file = file
        self.document = self._base = Document(file.text)
        self._field: Field | None = None
        self._before: list[Document] = []

    @property
    def unsaved(self) -> bool:
        return self.document.text != self.file.text

    def type(self, field: Field, text: str, shown: str) -> None:
        """A field holds `text` now; `shown` is what it had of the document when it was entered.

        Raises ConfigError for a value that can't be changed alone.
        """
        if field is not self._field:
            self.settle()
            self._field = field
        self.document = self._base if text == shown else changed(self._base, field, text)

    def settle(self) -> None:
        """The change under way is done; the next one begins from here."""
        if self.document.text != self._base.text:
            self._before.append(self._base)
        self._base, self._field = self.document, None

    def undo(self) -> bool:
        """Back to before the last change; False when there is none."""
        self.settle()
        if not self._before:
            return False
        self.document = self._base = self._before.pop()
        return True

    def save(self, *, anyway: bool = False) -> None:
        """Raises ChangedOnDiskError, ConfigError: see `saving.saved`."""
        self.settle()
        self.file = saved(self.file, self.document.text, anyway=anyway)

    def load_again(self) -> None:
        """What is on the disk now; what was typed can be undone back to. Raises ConfigError."""
        file = opened(self.file.path)
        require_toml(file.path, file.text)
        self.settle()
        if self.document.text != file.text:
            self._before.append(self.document)
        self.file, self.document = file, Document(file.text)
        self._base = self.document
