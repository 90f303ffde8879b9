"""`rig compare-fits`: has this thruster changed?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click

from identification.estimation.verdicts import ALPHA
from identification.thruster.comparison import POWER
from identification.thruster.thrust_forms import MODELS, Model
from identification.thruster.thrust_report import digits
from rig.catalogue.asking import CACHE, JSON, SINCE, UNTIL, aligned, tell
from rig.catalogue.entry import date_of
from rig.catalogue.fit_history import DatedFit, History, Pair
from rig.catalogue.fits_to_compare import Wanted, compared, sources_named, sources_of
from rig.catalogue.selection import Filter
from rig.errors import ConfigError
from rig.fit.as_json import difference_json, number
from rig.fit.command import AGAINST
from rig.fit.text import rarity


@click.command("compare-fits")
@click.argument("items", nargs=-1, metavar="[FIT-OR-RECORDING...] [FOLDER]")
@click.option("--thruster", default="", help="Of this thruster; with a FOLDER all of its recordings.")
@SINCE
@UNTIL
@click.option("--campaign", default="", help="Of the campaign of this name.")
@click.option("--model", type=click.Choice(MODELS), default="C V|V|", show_default=True, help="Model of the thrust.")
@click.option("--against", type=click.Choice(AGAINST), default=AGAINST[0], show_default=True, help="What explains it.")
@JSON
@CACHE
def compare_fits_command(
    items: tuple[str, ...],
    thruster: str,
    since: float | None,
    until: float | None,
    campaign: str,
    model: Model,
    against: str,
    json_path: Path | None,
    cache: Path,
) -> None:
    """Has a thruster changed? Compare its fits in order of time: each with the first and with the one before it.

    Give files or ids of fits and recordings, or a FOLDER and --thruster: then every recording of that thruster is
    fitted, those of one campaign together.
    """
    folders, named = [each for each in items if _is_plain_folder(each)], [e for e in items if not _is_plain_folder(e)]
    if len(folders) > 1:
        raise ConfigError(f"one folder is expected, {len(folders)} came: {', '.join(folders)}")
    if not named and not thruster:
        raise ConfigError("whose fits? Give files or ids of fits and recordings, or --thruster NAME [FOLDER]")
    if named and (since is not None or until is not None or campaign):
        raise ConfigError("--since, --until and --campaign choose in a folder; leave out the files, or the options")
    folder = Path(folders[0]) if folders else None
    chosen = Filter(thruster=thruster, campaign=campaign, since=since, until=until)
    sources = sources_named(named, folder, cache) if named else sources_of(folder or Path(), cache, chosen)
    found = compared(sources, Wanted(thruster, model, against))
    if len(found.fits) < 2:
        why = "; ".join(found.remarks)
        raise ConfigError(
            f"two fits of {found.thruster or 'a thruster'} are needed, {len(found.fits)} came"
            + (f": {why}" if why else "")
        )
    tell(json_path, lambda: history_json(found), lambda: history_text(found))


def _is_plain_folder(item: str) -> bool:
    return Path(item).is_dir()


def history_text(found: History) -> str:
    """Two tables, one sentence, and what to know before it is used."""
    lines = [f"{found.thruster or 'thruster'}: thrust = {found.model}, {len(found.fits)} fits in order of time", ""]
    lines += [f"  {line}" for line in aligned([_FITS, *_fit_rows(found)], 60)]
    lines += ["", *(f"  {line}" for line in aligned([_PAIRS, *(_pair_row(pair) for pair in found.pairs)]))]
    return "\n".join([*lines, "", sentence(found), *(f"  - {note}" for note in notes(found))])


_FITS = ("", "began (UTC)", "", "value", "U(k=2)", "unit", "RMSE / N", "recordings", "from")
_PAIRS = ("", "against", "", "difference", "std", "relative", "95 %", "p (Holm)", "")


def _fit_rows(found: History) -> Iterator[tuple[str, ...]]:
    for k, fit in enumerate(found.fits, 1):
        for name, p in fit.entry["parameters"].items():
            known = (digits(p["value"], p["std"]), digits(2 * p["std"], p["std"]))
            rmse = "" if fit.entry["rmse"] is None else f"{fit.entry['rmse']:.3g}"
            rest = (p["unit"], rmse, str(len(fit.entry["recordings"])), fit.source)
            yield (str(k), date_of(fit.began), name, *known, *rest)


def _pair_row(pair: Pair) -> tuple[str, ...]:
    d = pair.change.difference
    std = 100 * d.std / abs(d.value / d.relative) if d.relative else float("nan")
    percent = [digits(100 * x, std) for x in (d.relative, d.relative_low, d.relative_high)]
    return (
        str(pair.later + 1),
        f"{pair.earlier + 1} ({pair.against})",
        d.coefficient,
        digits(d.value, d.std),
        digits(d.std, d.std),
        f"{percent[0]} %",
        f"{percent[1]} to {percent[2]} %",
        rarity(pair.change.adjusted_p).removeprefix("p = ").removeprefix("p "),
        "changed" if pair.change.changed else "not at 5 %",
    )


def sentence(found: History) -> str:
    """The answer."""
    name = found.thruster or "the thruster"
    since = f"fit 1 ({date_of(found.fits[0].began)})" if found.fits[0].began is not None else "fit 1"
    count = len(found.pairs)
    share = f"at {100 * ALPHA:.0f} %" + (" for all comparisons together" if count > 1 else "")
    if not found.changed:
        last = [pair for pair in found.pairs if pair.earlier == 0 and pair.later == len(found.fits) - 1]
        seen = ", ".join(f"{p.change.difference.coefficient} of {_smallest(p)}" for p in last)
        return (
            f"{name} has not changed measurably since {since}, {share}; from the first fit to the last a change in "
            f"{seen} would have been seen in {100 * POWER:.0f} % of cases"
        )
    changed = [pair for pair in found.pairs if pair.change.changed]
    of_first = [pair for pair in changed if pair.earlier == 0]
    pair = of_first[-1] if of_first else changed[-1]
    d = pair.change.difference
    std = 100 * d.std / abs(d.value / d.relative) if d.relative else float("nan")
    size, word = digits(abs(100 * d.relative), std), "larger" if d.relative > 0 else "smaller"
    of = f"{d.coefficient} of fit {pair.later + 1} is {size} +- {digits(2 * std, std)} %"
    what = f"{of} {word} than that of fit {pair.earlier + 1}"
    place = f"since {since}" if of_first else f"between fits {pair.earlier + 1} and {pair.later + 1}"
    return f"{name} has changed {place}: {what} (k = 2); {len(changed)} of {count} differ {share}"


def _smallest(pair: Pair) -> str:
    d = pair.change.difference
    first = abs(d.value / d.relative) if d.relative else float("nan")
    return f"{100 * pair.change.smallest / first:.2g} %" if first > 0 else f"{pair.change.smallest:.2g}"


def notes(found: History) -> Iterator[str]:
    """What to know before the answer is used."""
    shared = {pair.shared for pair in found.pairs}
    if True in shared:
        which = "" if shared == {True} else f" ({_which(found.pairs, shared=True)})"
        yield f"same cell, same calibration{which}: its gain error cancels in the difference"
    if False in shared:
        which = "" if shared == {False} else f" ({_which(found.pairs, shared=False)})"
        yield f"cells or calibrations differ, or are not stated{which}: each gain error counts in full"
    if found.repeat is not None:
        yield found.repeat.statement
    else:
        yield "one recording of each: what taking it off and on again would change is not in these figures"
    yield from found.remarks


def _which(pairs: Sequence[Pair], *, shared: bool) -> str:
    return ", ".join(dict.fromkeys(f"{p.later + 1} against {p.earlier + 1}" for p in pairs if p.shared is shared))


def history_json(found: History) -> dict[str, Any]:
    """`thruster-rig-fit-history` version 1."""
    return {
        "format": "thruster-rig-fit-history",
        "version": 1,
        "thruster": found.thruster,
        "model": found.model,
        "fits": [_fit_json(fit) for fit in found.fits],
        "pairs": [_pair_json(pair) for pair in found.pairs],
        "changed": found.changed,
        "sentence": sentence(found),
        "notes": list(notes(found)),
    }


def _fit_json(fit: DatedFit) -> dict[str, Any]:
    date = date_of(fit.began, "seconds").replace(" ", "T")
    return {
        "source": fit.source,
        "began": f"{date}Z" if date else None,
        "recordings": list(fit.entry["recordings"]),
        "calibration": fit.entry.get("calibration", ""),
        "rmse": fit.entry["rmse"],
        "parameters": {
            name: {"value": p["value"], "std": p["std"], "expanded_k2": 2 * p["std"], "unit": p["unit"]}
            for name, p in fit.entry["parameters"].items()
        },
    }


def _pair_json(pair: Pair) -> dict[str, Any]:
    known = {
        key: value for key, value in difference_json(pair.change.difference).items() if key not in ("first", "second")
    }
    return {
        "earlier": pair.earlier,
        "later": pair.later,
        "against": pair.against,
        **known,
        "p_adjusted": number(pair.change.adjusted_p),
        "changed": pair.change.changed,
        "smallest_seen": number(pair.change.smallest),
        "shared_calibration": pair.shared,
    }
