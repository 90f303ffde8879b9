"""Sections of the page of `rig prove` that are not of the proof: other methods, and recordings made by others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rig.blind.beside import AtStrength, Beside, Found, Method, Peers, RealCase, RealRecordings
from rig.blind.report import figures
from rig.blind.report.figures import Row
from rig.blind.scoring.rates import Rate
from rig.report.page import Picture, Remark, Section, Sentences, Table, columns


def peers_section(shown: Sequence[Beside], versions: Sequence[str]) -> Section | None:
    """`versions` of the diagnosis: of the proof."""
    peers = [each for each in shown if isinstance(each, Peers)]
    if not peers:
        return None
    lead = (
        "Recordings of their own, not the cases above, but the same for each method. The peers choose among the "
        "columns that the catalogue offers, at settings tuned on other recordings; who names columns of the concealed "
        "effect alone is right."
    )
    parts: list[Picture | Table | Sentences] = []
    for each in peers:
        parts += [*_pictures(each), _peers_table(each), _of_peers(each, versions)]
    return Section("Peers on the same recordings", tuple(parts), lead)


def _pictures(peers: Peers) -> Iterable[Picture]:
    naming = [m for m in peers.methods if any(at.named for at in m.at)]
    strengths = sorted({at.strength for m in naming for at in m.at})
    if not strengths:
        return
    right = [Row(m.name, tuple(_share(m, d, "alone") for d in strengths)) for m in naming]
    names = [f"{d:g} sigma" for d in strengths]
    yield Picture(
        "Right, and nothing else named",
        figures.rates(right, names, "right alone / %"),
        "Bars are 95 % intervals (Wilson).",
    )
    wrong = [Row(m.name, (*(_share(m, d, "wrong") for d in strengths), _alarms(m))) for m in naming]
    series = (*(f"wrong, {name}" for name in names), "false alarm, clean")
    yield Picture(
        "Names of what is not there",
        figures.rates(wrong, series, "wrong names, false alarms / %"),
        "Wrong: names, the concealed effect neither among them nor among stated rivals.",
    )


def _share(method: Method, strength: float, outcome: str) -> Rate:
    named = next((at.named for at in method.at if at.strength == strength), None)
    return Rate(0, 0) if named is None else Rate(getattr(named, outcome), named.n)


def _alarms(method: Method) -> Rate:
    return Rate(method.alarms, method.alarms + method.quiet)


def _peers_table(peers: Peers) -> Table:
    head = (
        "method",
        "strength / sigma",
        "right alone",
        "right among names",
        "wrong",
        "none",
        "false alarms",
        "error, median",
        "error, 95 %",
        "CPU s, median",
    )
    rows = tuple(_peers_row(method, at) for method in peers.methods for at in method.at)
    return Table(f"{peers.each} recordings of each kind; error: held out, over that of the noise", head, rows)


def _peers_row(method: Method, at: AtStrength) -> tuple[str, ...]:
    n = at.named
    counts: tuple[str, ...] = ("",) * 5
    if n is not None:
        counts = (*(Rate(hits, n.n).told for hits in (n.alone, n.among, n.wrong, n.none)), _alarms(method).told)
    seconds = "" if n is None else f"{at.seconds:.1f}"
    return method.name, f"{at.strength:g}", *counts, _ratio(at.error_median), _ratio(at.error_95), seconds


def _of_peers(peers: Peers, versions: Sequence[str]) -> Sentences:
    packages = ", ".join(f"{name} {version}" for name, version in peers.packages.items())
    settings = "; ".join(f"{m.name} {_words(m.setting)}" for m in peers.methods if m.setting)
    return Sentences(
        (
            f"Seeds {peers.first_seed} and up, world {peers.world}; {packages or 'no versions told'}.",
            *([f"Settings: {settings}."] if settings else []),
            _version(peers.diagnosis, versions),
        )
    )


def _words(setting: dict[str, float | str]) -> str:
    return ", ".join(f"{name} {value if isinstance(value, str) else f'{value:g}'}" for name, value in setting.items())


def real_section(shown: Sequence[Beside], versions: Sequence[str]) -> Section | None:
    """`versions` of the diagnosis: of the proof."""
    real = [each for each in shown if isinstance(each, RealRecordings)]
    if not real:
        return None
    lead = (
        "Made by others with thrusters and vehicles of theirs. Nobody sealed a truth there: what was not fitted is the "
        "judge, its error before and after what was found, beside the noise."
    )
    cases = [case for each in real for case in each.cases]
    said = Sentences(tuple(_said(case) for case in cases))
    versions_said = dict.fromkeys(_version(each.diagnosis, versions) for each in real)
    return Section("Real recordings", (_real_table(cases), said, Sentences(tuple(versions_said))), lead)


def _real_table(cases: Sequence[RealCase]) -> Table:
    head = ("recording", "verdict", "named", "before", "after", "noise")
    rows = tuple((case.name, case.verdict, _names(case.findings), *_held_out(case)) for case in cases)
    return Table("RMSE per sample of what was not fitted", head, rows, columns(head, "recording", "verdict", "named"))


def _names(findings: Iterable[Found]) -> str:
    """With their stated rivals.

    >>> _names([Found("heating", "", "", ("supply_sag",)), Found("asymmetry", "", "", ())])
    'heating (or supply_sag) + asymmetry'
    """
    return " + ".join(f.effect + (f" (or {', '.join(f.rivals)})" if f.rivals else "") for f in findings)


def _held_out(case: RealCase) -> tuple[str, ...]:
    held = case.held_out
    if held is None:
        return ("",) * 3
    return tuple("" if x is None else f"{x:.4g} {case.unit}" for x in (held.before, held.after, held.noise))


def _said(case: RealCase) -> str | Remark:
    held = case.held_out
    if held is None:
        return Remark(f"{case.name}: {case.statement}", "bad")
    return f"{case.name}: {case.statement} Not fitted: {held.what}."


def _ratio(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _version(version: str, versions: Sequence[str]) -> Remark:
    """Another version than the proof's is told as a doubt."""
    if version in versions or not versions:
        return Remark(f"By version {version} of the diagnosis.")
    return Remark(f"By version {version} of the diagnosis, which is not that of this proof.", "doubt")
