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
from identification.mismatch.validate.stage import Validated


@dataclass(frozen=True, eq=False, slots=True)
class Trace:
    """All that passed between the stages of one diagnosis of a thruster; `rig diagnose --explain` prints it."""

    prepared: Prepared
    sound: Sound
    first: Selected
    """The model of the runs as they are: periodic disturbances are looked for in what it leaves."""
    cleaned: Cleaned
    selected: Selected
    """After the search was begun again, where lines or bands were found, and rivals were exchanged."""
    located: Located
    named: tuple[Named, ...]
    validated: Validated
    completed: Completed
    diagnosis: Diagnosis
