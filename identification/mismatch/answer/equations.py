"""The whole model line by line, to be typed in: each term says its own, in the order in which the bench acts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

from identification.mismatch.diagnosis import Equation
from identification.mismatch.model.predictor import winding_of
from identification.mismatch.periodic.periodic_disturbances import EFFECT
from identification.physics.equation import signed
from identification.physics.term import EquationContext, Stage
from identification.run_history.history import TURNING
from identification.twin import Twin, TwinLine


def equations_of(twin: Twin, tares: Mapping[str, float], recorded: Collection[str] = ()) -> tuple[Equation, ...]:
    """A twin's model from the driver to the reading. `tares`: N, of each recording by its id; `recorded`: quantities
    that are there beside command and thrust."""
    told = _told(twin, frozenset(recorded))
    V = "n" if twin.driver_quantity == "rotation_rate" else "V"
    return (
        Equation(f"{V} = {twin.driver_quantity}  # {_driver(twin, V)}"),
        *_of(told, "command"),
        *_rotor([lines for stage, lines in told if stage == "rotor"], V),
        Equation(f"F = {twin.C:.6g} * x * abs(x)  # N; x: the rotor's rate, as the {V} that would keep it"),
        *_of(told, "hydro", "stand"),
        *_tares(tares),
        *_of(told, "cell"),
        *(each for line in twin.lines for each in _periodic(line, twin.highest_driver)),
        Equation("thrust = F + tare"),
    )


def _driver(twin: Twin, name: str) -> str:
    unit = "rev/s" if name == "n" else "V"
    between = "held until its next row" if twin.driver_quantity == "command_voltage" else "straight from row to row"
    return f"{unit}, {between}; recorded up to {twin.highest_driver:.4g}"


Told = Sequence[tuple[Stage, tuple[Equation, ...]]]
"""Of each term its stage and its lines."""


def _told(twin: Twin, recorded: frozenset[str]) -> Told:
    winding = winding_of([(t.term, t.values, t.scale) for t in twin.terms])
    k, out = twin.slip_rate or 1.0, []
    for t in twin.terms:
        model = EquationContext(t.scale, twin.C, twin.driver_quantity, winding, k, recorded)
        lines = t.term.equation(t.values, model)
        out.append((t.term.stage, tuple(Equation(line, t.effect) for line in lines)))
    return out


def _of(told: Told, *stages: Stage) -> Iterator[Equation]:
    return (each for stage, lines in told if stage in stages for each in lines)


def _rotor(told: Sequence[tuple[Equation, ...]], V: str) -> Iterator[Equation]:
    """Each term makes x of V; where there is none they are one."""
    if not told:
        yield Equation(f"x = {V}")
    for i, lines in enumerate(told):
        if i:
            yield Equation(f"{V} = x")
        yield from lines


def _tares(tares: Mapping[str, float]) -> Iterator[Equation]:
    for name, tare in tares.items():
        whose = f"run {name}" if len(tares) > 1 else "this run"
        yield Equation(f"tare = {tare:.6g}  # N, of {whose}; none of the thruster's")


def _periodic(line: TwinLine, highest_driver: float) -> Iterator[Equation]:
    """On the clock of the recording; one that goes with the rotor by the angle turned, silent at rest."""
    told = "" if line.phase is not None else "  # its phase slips"
    phase = signed(line.phase or 0.0)
    if line.ratio is None:
        yield Equation(f"F = F + {line.amplitude:.6g} * sin(2 * pi * {line.frequency:.6g} * t {phase}){told}", EFFECT)
        return
    rate = "abs(x)" if line.turns == "V s" else "abs(rotation_rate)"
    size = f"({rate} / {line.at_speed:.6g}) ** {line.growth:g}" if line.at_speed > 0 else _turning(highest_driver)
    yield Equation(f"d(turns)/dt = {rate}, turns(0) = 0", EFFECT)
    wave = f"sin(2 * pi * {line.ratio:.6g} * turns {phase})"
    yield Equation(f"F = F + {line.amplitude:.6g} * {size} * {wave}{told}", EFFECT)


def _turning(highest_driver: float) -> str:
    return f"(abs(x) > {TURNING * highest_driver:.6g})"
