"""`rig fleet PAGE`: control charts over a fleet's fits, who left the limits, and what those hide."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from rig.errors import RecordingError, RigError
from rig.fleet.options import LIMIT, STORE, Fleet, fleet_of
from rig.fleet.store import Store, opened
from rig.fleet_report.answers import Diagnosed, diagnosed
from rig.fleet_report.departures import departures_of, to_diagnose, usual
from rig.fleet_report.figures_of_units import charts_of
from rig.fleet_report.page import FleetReport, fleet_page, lead
from rig.fleet_report.units import units_of
from rig.result_path import RESULT, RESULT_FILE, require_different
from rig.workers.interrupting import interruptible

DIAGNOSED = 20
NO_FITS = "{} holds no fits; make them first: rig fit FILES --jobs 2 --store {}"


@click.command("fleet")
@click.argument("page", type=RESULT_FILE)
@click.option(
    "--store",
    type=click.Path(file_okay=False, path_type=Path),
    default=STORE,
    show_default=True,
    help="Folder of the rows that `rig fit FILES --jobs N` kept.",
)
@click.option(
    "--diagnose",
    "most",
    type=click.IntRange(min=0),
    default=DIAGNOSED,
    show_default=True,
    metavar="N",
    help="So many of the units that left their limits are diagnosed.",
)
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Diagnoses at once.  [default: 1]")
@click.option("--scheduler", metavar="tcp://HOST:PORT", help="Diagnose on the workers of a Dask cluster.")
@click.option(
    "--sigmas",
    type=click.FloatRange(min=1.0, max=10.0),
    help="Limits, in standard deviations; by default such that a sound fleet shows one in a twentieth of cases.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the diagnoses.")
@click.option("--json", "json_path", type=RESULT, help="Write what was found here; - is standard output.")
def fleet_command(
    page: Path,
    store: Path,
    most: int,
    jobs: int | None,
    scheduler: str | None,
    sigmas: float | None,
    seed: int,
    json_path: Path | None,
) -> None:
    """Write a page of a whole fleet: which thrusters left their limits, since when, what they hide.

    Over the serial numbers, with the error taken out that all units measured under one calibration share.

    Exit status 0 whatever was found, 2 where nothing could be told.
    """
    try:
        require_different(("PAGE", page), ("--json", json_path))
        fleet = fleet_of(jobs or (None if scheduler else 1), scheduler, store, None) or Fleet(1, store, LIMIT)
        if not (store / "rows.sqlite").is_file():
            raise RecordingError(NO_FITS.format(store, store))
        with opened(store) as kept, interruptible():
            told = fleet_report(kept, fleet, most, sigmas, seed)
        from rig.report.page import write  # matplotlib draws on the way

        write(fleet_page(told), page)
        text = json.dumps(as_json(told), indent=1, allow_nan=False)
        if json_path is not None and str(json_path) != "-":
            json_path.write_text(text + "\n", encoding="utf-8")
        click.echo(text if str(json_path) == "-" else f"{lead(told)} {page}")
    except (RigError, OSError) as error:
        click.echo(f"rig fleet: {error}", err=True)
        raise SystemExit(2) from error


def fleet_report(store: Store, fleet: Fleet, most: int, sigmas: float | None, seed: int) -> FleetReport:
    """From the fits of a store. Raises RecordingError where it has none, and what a diagnosis raises."""
    units = units_of(store.rows_of("fits"))
    if not units.rows:
        raise RecordingError(NO_FITS.format(store.root, store.root))
    charts = charts_of(units.rows, sigmas)
    found = departures_of(charts)
    places = to_diagnose(units.rows, charts, found, most)
    answers = Diagnosed({})
    if places:
        common = usual(units.rows, charts, found)
        odd = [units.rows[place] for place in places if place != common]
        answers = diagnosed(odd, units.rows[common], store, fleet, seed)
    return FleetReport(units, charts, found, answers)


def as_json(told: FleetReport) -> dict[str, Any]:
    """What the page tells, for a program."""
    rows = told.units.rows
    return {
        "format": "thruster-rig-fleet",
        "version": 1,
        "units": len(rows),
        "limit": told.charts[0].chart.limit if told.charts else None,
        "usual": None if told.diagnosed.usual is None else told.diagnosed.usual["thruster"],
        "alone": [
            {
                "thruster": rows[each.place]["thruster"],
                "recording_id": rows[each.place]["recording_id"],
                "off": [{"figure": name, "sigma": z, "shown": shown} for name, z, shown in each.off],
                "diagnosis": told.diagnosed.by.get(rows[each.place]["sha256"]),
            }
            for each in told.found.alone
        ],
        "stretches": [
            {
                "figure": each.charted.figure.name,
                "first": rows[each.places[0]]["thruster"],
                "last": rows[each.places[-1]]["thruster"],
                "units": len(each.places),
                "since": rows[each.places[0]]["created"],
                "sigma": each.stretch.size,
                "shown": each.size,
                "diagnoses": [d for p in each.places if (d := told.diagnosed.by.get(rows[p]["sha256"])) is not None],
            }
            for each in told.found.together
        ],
        "without_fit": [{"url": row["url"], "error": row["error"]} for row in told.units.without],
    }
