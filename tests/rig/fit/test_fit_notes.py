"""What `rig fit` says beside its numbers: recordings by the names of their files, and thrust that is out of step."""

import numpy as np
import pytest

from identification.recording import Channel, Recording, Step
from rig.fit.answer import fit_recordings
from rig.fit.command import fit_text
from tests.rig.fit.test_fit import run, write

LEVELS = np.array([-10.0, -6.0, -3.0, 0.0, 3.0, 6.0, 10.0])
LEVEL = 4.0


def table(source, place, seed=0):
    """A level table whose means stand at `place` (0 to 1) of their level."""
    begins = np.arange(LEVELS.size) * LEVEL
    thrust = 0.4 * LEVELS * np.abs(LEVELS) + np.random.default_rng(seed).normal(0, 0.1, LEVELS.size)
    command = Channel("u", "drive", "command_voltage", "V", begins, LEVELS)
    cell = Channel("f", "cell", "thrust", "N", begins + place * LEVEL, thrust)
    steps = tuple(Step(k, "hold", v, t, t + LEVEL) for k, (v, t) in enumerate(zip(LEVELS, begins, strict=True)))
    return Recording(
        f"id-of-{source}", "T1", (command, cell), steps, kind="bollard", outcome="completed", source=source
    )


@pytest.mark.parametrize(("place", "warned"), [(0.0, True), (0.5, False)])
def test_a_table_half_a_level_out_of_step_is_warned_of(place, warned):
    text = fit_text(fit_recordings([table("monday.h5", place)]))
    assert ("monday.h5: thrust leads its command by 2 s, 50 % of a level" in text) is warned


def test_recordings_are_told_by_their_files():
    text = fit_text(fit_recordings([table("monday.h5", 0.5), table("tuesday.h5", 0.5, seed=1)]))
    assert "tare 1 is of monday.h5, tare 2 is of tuesday.h5" in text
    assert "id-of-" not in text


def test_a_constant_of_a_model_that_does_not_fit_is_not_told_without_a_warning(tmp_path):
    straight, bent = write(tmp_path / "straight.h5"), write(tmp_path / "bent.h5", C_minus=0.3)
    assert "does NOT fit" not in run(straight).output
    told = run(bent).output.splitlines()
    at = next(i for i, line in enumerate(told) if "does NOT fit its points (chi2/dof" in line)
    assert "next: rig diagnose" in told[at]
    assert at == 1, "beside the sentence that tells the constant"
