"""From recordings and a bench to one answer that stands: diagnose, run the next experiment, diagnose again."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.campaign.config import CampaignConfig
from rig.campaign.loading import load_bench, load_campaign
from rig.campaign.plan import TareConfig
from rig.campaign.plan_file import Level, Template, write_campaign
from rig.diagnose.command import diagnose_files
from rig.diagnose.next_plan import limits_of, write_next
from rig.errors import RigError
from rig.operate.flow_setting import SetFlow
from rig.operate.front_ends import progress_bar
from rig.operate.run import require_runnable, run_campaign

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.next_experiment.sequential_experiment import Course, End

OPENING = 20.0
"""s of a run beside its plan: ports, preflight, mounting, closing, table; seen on a loaded two-core machine."""


@dataclass
class SequentialExperiment:
    """The bench as the loop sees it: it diagnoses what there is, and runs what it is told."""

    campaign: CampaignConfig
    folder: Path
    files: list[Path]
    budget: float
    """s"""
    seed: int = 0
    set_flow: SetFlow | None = None
    """None: nobody sets the flow, so still water is all that is proposed."""
    say: Callable[[str], None] = click.echo
    begun: float = field(default_factory=time.monotonic)
    thinking: float = 0.0
    """s of the longest diagnosis so far."""
    flow: float = 0.0
    """m/s, as it was set last; it is still when this begins."""
    setting: float = 0.0
    """s that the flow took at most so far."""

    def run(self) -> tuple[Diagnosis, Course, End]:
        """Until one answer stands, the water still again.

        Raises RigError for input that cannot be used, before anything moves; after that what goes wrong is an end.
        """
        from identification.mismatch.next_experiment.sequential_experiment import Course, End, belief, opening_line

        found = self._diagnosed(0.0)
        course = Course(self.budget, belief(found), self._spent())
        self.say(opening_line(course))
        try:
            while True:
                try:
                    found, course, end = self._round(found, course)
                except (RigError, OSError, click.Abort, KeyboardInterrupt) as error:
                    why = str(error) or "broken off by the operator"
                    return found, course, End("aborted", f"{course.now.says}; the run was aborted: {why}")
                if end is not None:
                    return found, course, end
        finally:
            self._still()

    def _round(self, found: Diagnosis, course: Course) -> tuple[Diagnosis, Course, End | None]:
        """One experiment and its diagnosis, or why there is none."""
        from identification.mismatch.next_experiment.sequential_experiment import End, next_step, round_line

        plans = self._written(found, len(course.rounds) + 1)
        step = next_step(course, self._needs(plans))
        if isinstance(step, End):
            return found, course, step
        began = time.monotonic()
        self.files += self._run(plans)
        on_bench = time.monotonic() - began
        found = self._diagnosed(self._spent())
        course = course.after(on_bench, self._spent(), found)
        self.say(round_line(course))
        return found, course, None

    def _spent(self) -> float:
        return time.monotonic() - self.begun

    def _diagnosed(self, spent: float) -> Diagnosis:
        from identification.mismatch.next_experiment.sequential_experiment import allowance

        began = time.monotonic()
        room = allowance(self.budget - spent, fixed_cost(self.campaign) + self.thinking)
        limits = limits_of(self.campaign, room, () if self.set_flow is None else None)
        found = diagnose_files(self.files, seed=self.seed, limits=limits)
        self.thinking = max(self.thinking, time.monotonic() - began)
        return found

    def _written(self, found: Diagnosis, number: int) -> tuple[Path, ...]:
        """The plans of the next experiment: one for each flow speed, none when there is no experiment."""
        return write_next(found, self.campaign, self.folder / f"round-{number}.toml", attended=True)

    def _needs(self, plans: Sequence[Path]) -> float:
        """S until the plans are run and diagnosed."""
        return sum(_expected(load_campaign(plan)) + self.setting for plan in plans) + self.thinking

    def _run(self, plans: Sequence[Path]) -> list[Path]:
        """The recordings of the plans, each run as `rig run --headless` runs it. Raises RigError when one is aborted.

        What the run prints goes to standard error: standard output is the answer's.
        """
        made: list[Path] = []
        for plan in plans:
            config = require_runnable(plan, (), headless=True)
            self._flow_at(config.flow_speed or 0.0)
            folder = self.folder / plan.stem
            folder.mkdir()
            with contextlib.redirect_stdout(sys.stderr):
                status = run_campaign(plan, folder, (), progress_bar(start=True))
            if status:
                raise RigError(f"{folder} holds what was recorded and why it ended")
            made += sorted(folder.glob("*.h5"))
        return made

    def _flow_at(self, speed: float) -> None:
        """Raises RigError when the water cannot be brought to `speed` m/s."""
        if self.set_flow is None or speed == self.flow:
            return
        began = time.monotonic()
        self.flow = math.nan  # until it is known again
        self.set_flow(speed)
        self.flow = speed
        self.setting = max(self.setting, time.monotonic() - began)

    def _still(self) -> None:
        """Whatever happened; a flow that goes on is said."""
        try:
            self._flow_at(0.0)
        except (RigError, click.Abort, KeyboardInterrupt) as error:
            self.say(f"THE WATER MAY STILL FLOW: it could not be brought to rest: {str(error) or 'broken off'}")


def _expected(campaign: CampaignConfig) -> float:
    """S of one run of the plan, with its opening and the watchdog proof."""
    from rig.sequence.sequencer import settings_for

    proof = settings_for(campaign, "").proof
    return OPENING + campaign.plan.duration().expected + (proof.expected if proof else 0.0)


def fixed_cost(campaign: CampaignConfig) -> float:
    """S of a run beside its sweep: opening, watchdog proof, both tares, waits before them, the rest before the last."""
    plan = campaign.plan
    return _expected(campaign) - plan.duration().expected + 2 * (campaign.tare.duration + plan.settle_water) + plan.rest


def bench_alone(bench: Path, thruster: str, folder: Path) -> CampaignConfig:
    """A campaign of the bench with the tare and the pacing that are the defaults. Raises ConfigError."""
    config = load_bench(bench)
    template = Template("settle", bench, (thruster,), folder, config.slew, TareConfig(), notes="rig settle --bench")
    (file,) = write_campaign([Level(0.0, 3.0)], template, folder / "bench-alone.toml", ("Bench and pacing only.",))
    return load_campaign(file)
