"""What stands in for a channel that an effect needs and nobody recorded: the answer says so."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from identification.mismatch.diagnosis import Finding
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.channels import neighbour_of
from identification.recording import Recording
from identification.run_history.history import History


@dataclass(frozen=True, slots=True)
class Proxy:
    """What one form of an effect takes in the place of a quantity."""

    quantity: str
    """Of recording-format.md; where it is recorded the form looks at it, or stands beside one that does."""
    lacks: str
    instead: str


POWER = "the power drawn before, the fourth power of the rotor's rate as the model has it, low-passed"
JET = "the rotor's rate as the model has it, low-passed"
_TEMPERATURE = Proxy("motor_temperature", "no motor temperature was recorded", POWER)
_FLOW = Proxy("flow_speed", "no flow was recorded", JET)
_RATE = Proxy("rotation_rate", "no rotation rate was recorded", "the voltage, as the steady rate that goes with it,")
_TORQUE = Proxy("torque", "no torque was recorded", "the square of the rotor's rate as the model has it")
_BUS = "no bus voltage was recorded"
PROXIES: Mapping[tuple[str, str], Proxy] = {
    ("heating", "winding"): _TEMPERATURE,
    ("heating", "magnet"): _TEMPERATURE,
    ("supply_sag", "discharge"): Proxy("bus_voltage", _BUS, "the energy drawn so far, |V|^3 over time,"),
    ("supply_sag", "loaded"): Proxy("bus_voltage", _BUS, "the power drawn, |V|^3,"),
    ("recirculation", "rate"): _FLOW,
    ("recirculation", "thrust"): Proxy("flow_speed", _FLOW.lacks, "the root of the thrust, low-passed"),
    ("recirculation", "circuit"): Proxy("flow_speed", _FLOW.lacks, f"{JET} twice"),
    ("cavitation", "linear"): _RATE,
    ("cavitation", "square"): _RATE,
    ("torque_crosstalk", ""): _TORQUE,
}
"""By effect and form."""
CURRENT = "the power drawn before, the recorded current squared, low-passed"
TURNS = "periods_per_volt_second"
"""Parameter of a line that is locked to the integral of the voltage."""


def proxies(
    model: Model, findings: Sequence[Finding], recordings: Sequence[Recording], histories: Sequence[History]
) -> tuple[str, ...]:
    """A sentence for each that the model, a finding or a rival of one makes use of.

    `histories`: of the recordings, in their order, with what all of them hold.
    """
    used = [(term.id, term.form) for term in (*(g.term for g in model.given), *model.terms)]
    used += [(f.effect, f.form) for f in findings] + [(r.effect, r.form) for f in findings for r in f.rivals]
    have = {histories[0].driver_quantity}.union(set.intersection(*(set(h.others) for h in histories)))
    out = [_said(effect, proxy, have) for effect, form in used if (proxy := PROXIES.get((effect, form))) is not None]
    effects = {effect for effect, _ in used}
    if "thruster_interaction" in effects and _by_command(recordings):
        out.append("thruster_interaction: the neighbour's thrust was not recorded; V|V| of its command stands for it.")
    if any(TURNS in f.parameters for f in findings):
        out.append(
            "periodic_disturbance: no rotation rate was recorded; the integral of |V| stands for the rotor's turns."
        )
    return tuple(dict.fromkeys(text for text in out if text))


def _said(effect: str, proxy: Proxy, have: Collection[str]) -> str:
    """Empty where the quantity was recorded."""
    if proxy.quantity in have:
        return ""
    instead = CURRENT if effect == "heating" and "current" in have else proxy.instead
    return f"{effect}: {proxy.lacks}; {instead} stands for it."


def _by_command(recordings: Sequence[Recording]) -> bool:
    """Whether a neighbour is known by its command in one of them."""
    known = [neighbour_of(recording) for recording in recordings]
    return any(channel is not None and channel.quantity == "command_voltage" for channel in known)
