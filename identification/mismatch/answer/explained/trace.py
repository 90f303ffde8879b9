"""What every stage of one diagnosis handed on, in their order."""

from __future__ import annotations

from dataclasses import dataclass

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.faults.stage import Sound
from identification.mismatch.locate.stage import Located
from identification.mismatch.name.naming import Named
from identification.mismatch.periodic.stage import Cleaned
from identification.mismatch.prepare.stage import Prepared
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.unnamed.stage import Completed
from identification.mismatch.validate.judged import Judged
from identification.mismatch.validate.stage import Validated


@dataclass(frozen=True, eq=False, slots=True)
class Trace:
    """All that passed between the stages of one diagnosis of a thruster; `rig diagnose --explain` prints it."""

    prepared: Prepared
    sound: Sound
    first: Selected
    """The model of the runs as they are: periodic disturbances are looked for in what it leaves."""
    cleaned: Cleaned
    chosen: Judged
    """After the search was begun again, where lines or bands were found, rivals were exchanged, and what was not fitted
    refused no term."""
    completed: Completed
    diagnosis: Diagnosis

    @property
    def selected(self) -> Selected:
        return self.chosen.selected

    @property
    def located(self) -> Located:
        return self.chosen.located

    @property
    def named(self) -> tuple[Named, ...]:
        return self.chosen.named

    @property
    def validated(self) -> Validated:
        return self.chosen.validated
