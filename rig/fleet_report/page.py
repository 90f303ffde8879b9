"""The page of a fleet: who left the limits, alone or as a stretch, what they hide, and the charts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rig.fleet.question import Row
from rig.fleet_report.answers import Diagnosed
from rig.fleet_report.departures import Alone, Departures, Together
from rig.fleet_report.figures_of_units import FEWEST, FIGURES, Charted
from rig.fleet_report.pictures import picture
from rig.fleet_report.units import Units
from rig.report.page import Page, Remark, Section, Sentences, Table, columns, sentences

NOT_DIAGNOSED = "not diagnosed (--diagnose takes more)"
UNITS = ("thruster", "made", "off by", "what it differs in from the usual unit")
STRETCHES = ("from", "to", "units", "since", "off by", "what those differ in that are most like the others")
SHARED = ("calibration", "figure", "units", "off by / %", "it states / %", "taken out / %")
WITHOUT = ("file", "why")


@dataclass(frozen=True)
class FleetReport:
    """All that a page of a fleet tells."""

    units: Units
    charts: Sequence[Charted]
    found: Departures
    diagnosed: Diagnosed


def fleet_page(told: FleetReport) -> Page:
    """See the sections."""
    sections = (
        alone_section(told),
        stretch_section(told),
        *chart_sections(told),
        calibration_section(told.charts),
        without_section(told.units),
    )
    return Page("Fleet of thrusters", lead(told), sections, contents=True)


def lead(told: FleetReport) -> str:
    """The one sentence."""
    count = len(told.units.rows)
    if not told.charts:
        return f"{count} units: charts need {FEWEST} at least."
    alone, stretched = len(told.found.alone), len(told.found.together)
    said = f"{count:,} units: "
    said += "none left its limits alone" if not alone else f"{_many(alone, 'unit')} left the limits alone"
    said += (
        ", and no stretch of the production is off."
        if not stretched
        else (
            f", and {_many(stretched, 'stretch', 'stretches')} of the production "
            f"{'is' if stretched == 1 else 'are'} off: {_first(told)}."
        )
    )
    return said


def _first(told: FleetReport) -> str:
    each = told.found.together[0]
    first, last = (told.units.rows[place] for place in (each.places[0], each.places[-1]))
    return f"{each.charted.figure.what} from {first['thruster']} to {last['thruster']}"


def _many(count: int, one: str, more: str = "") -> str:
    return f"{count:,} {one if count == 1 else more or one + 's'}"


def alone_section(told: FleetReport) -> Section:
    """Units that are out by themselves, most first."""
    rows = tuple(_unit(each, told) for each in told.found.alone)
    parts = (Table("Most far out first", UNITS, rows, columns(UNITS, *UNITS)),) if rows else ()
    nobody = () if rows else sentences(("No unit is outside the limits by itself.",))
    return Section("Units outside", (*_against(told.diagnosed), *nobody, *parts))


def _against(found: Diagnosed) -> tuple[Sentences, ...]:
    if found.why_not:
        return sentences((Remark(found.why_not, "doubt"),))
    if found.usual is None:
        return ()
    return sentences(
        (
            f"Diagnosed against the twin of {found.usual['thruster']}, which is as usual as any: what all units have "
            "is in it, and what is named is what a unit has besides.",
        )
    )


def _unit(each: Alone, told: FleetReport) -> tuple[str, ...]:
    row = told.units.rows[each.place]
    off = "; ".join(f"{name} {_amount(name, shown)} ({z:+.1f} σ)" for name, z, shown in each.off)
    return (row["thruster"], _day(row), off, told.diagnosed.of(row) or NOT_DIAGNOSED)


def _amount(name: str, shown: float) -> str:
    unit = next(figure.unit for figure in FIGURES if figure.name == name)
    return f"{shown:+.3g} {unit.split()[0]}"


def stretch_section(told: FleetReport) -> Section:
    """Stretches of the production whose mean is off."""
    rows = tuple(_stretch(each, told) for each in told.found.together)
    words = columns(STRETCHES, *(name for name in STRETCHES if name != "units"))
    parts = (
        (Table("By size", STRETCHES, rows, words),) if rows else sentences(("No stretch of the production is off.",))
    )
    return Section("Stretches of the production", parts)


def _stretch(each: Together, told: FleetReport) -> tuple[str, ...]:
    rows = [told.units.rows[place] for place in each.places]
    name = each.charted.figure.name
    said = dict.fromkeys(text for row in rows if (text := told.diagnosed.of(row)))
    off = f"{name} {_amount(name, each.size)} ({each.stretch.size:+.1f} σ of a unit)"
    return (
        rows[0]["thruster"],
        rows[-1]["thruster"],
        f"{len(rows):,}",
        _day(rows[0]),
        off,
        " / ".join(said) or NOT_DIAGNOSED,
    )


def _day(row: Row) -> str:
    return str(row["created"] or "")[:10]


def chart_sections(told: FleetReport) -> tuple[Section, ...]:
    """The pictures."""
    if not told.charts:
        return ()
    drawn = tuple(picture(charted, told.units.rows) for charted in told.charts)
    limit = told.charts[0].chart.limit
    text = (
        f"Limits at {limit:.3g} standard deviations of a unit: with these, all charts of a fleet without an odd unit "
        "show one in a twentieth of cases at most. Centre and limits are of the units that are inside."
    )
    return (Section("Charts", (*sentences((text,)), *drawn)),)


def calibration_section(charts: Sequence[Charted]) -> Section:
    """What was taken out as the shared error of a calibration."""
    rows = tuple(row for charted in charts if charted.figure.name == "C" for row in _shared(charted))
    if not rows:
        text = (
            "The recordings state no error that all units measured under one calibration share: nothing was taken out."
        )
        return Section("Calibrations", sentences((text,)))
    beyond = [
        Remark(f"Units under calibration {name} are further off than it states: the rest stays in the charts.", "doubt")
        for name in dict.fromkeys(_beyond(charts))
    ]
    table = Table("Shared error of each calibration", SHARED, rows, columns(SHARED, "calibration", "figure"))
    return Section("Calibrations", (*sentences(beyond), table))


def _shared(charted: Charted) -> list[tuple[str, ...]]:
    scale = charted.figure.scale
    return [
        (
            charted.calibrations[each.group] or "(not said)",
            charted.figure.name,
            f"{each.units:,}",
            f"{each.difference * scale:+.3f}",
            f"{each.stated * scale:.3f}",
            f"{each.removed * scale:+.3f}",
        )
        for each in charted.chart.shared
    ]


def _beyond(charts: Sequence[Charted]) -> list[str]:
    return [c.calibrations[each.group] for c in charts for each in c.chart.shared if each.beyond]


def without_section(units: Units) -> Section:
    """What is in no chart."""
    said: list[str | Remark] = []
    if units.twice:
        said.append(f"{_many(units.twice, 'file')} of recordings that another file is of: counted once.")
    said += [
        Remark(f"{_many(count, 'row')} asked otherwise ({options}): not in the charts.", "doubt")
        for options, count in units.aside.items()
    ]
    rows = tuple((str(row["url"]), str(row["error"])) for row in units.without)
    table = (Table("No fit", WITHOUT, rows, columns(WITHOUT, *WITHOUT), folded=len(rows) > 20),) if rows else ()
    if not rows and not said:
        said.append("Every recording has its fit and is in the charts.")
    return Section("Not in the charts", (*sentences(said), *table))
