"""What a seal says: what is hidden, how strongly, and what the recording is like. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Table = Mapping[str, Any]


def concealed(truth: Table) -> tuple[str, ...]:
    """Ids of what is hidden in a case, and not in an earlier recording of the same thruster."""
    lie = ("channel_fault",) if truth["fault"] else ()
    return (*(effect["effect"] for effect in _new(truth)), *lie)


def strengths(truth: Table) -> tuple[float, ...]:
    """Of what is hidden, each d' beside the others."""
    return () if truth["fault"] else tuple(float(effect["d_prime"]) for effect in _new(truth))


def _new(truth: Table) -> list[Table]:
    known = truth.get("known", ())
    return [effect for effect in truth["effects"] if effect["effect"] not in known]


def described(truth: Table) -> str:
    """Noise, sampling, plan, channels, and the effects with their parameters.

    >>> effect = {"effect": "dead_band", "parameters": {"form": "jump", "half_width": 0.51234}}
    >>> scale = {"voltage": 10.0, "thrust": 80.0, "duration": 400.2}
    >>> seal = {"noise_kind": "white", "rate": 25.0, "plan": ["ramp"], "channels": ["current"], "scale": scale}
    >>> described(seal | {"effects": [effect], "fault": None})
    'white noise, 25 /s, ramp of 400 s, 10 V, 80 N, with current; dead_band: form jump, half_width 0.5123'
    """
    scale = truth["scale"]
    with_channels = f", with {', '.join(truth['channels'])}" if truth["channels"] else ""
    plan = f"{' and '.join(truth['plan'])} of {scale['duration']:.0f} s"
    parts = [
        f"{truth['noise_kind']} noise, {truth['rate']:.3g} /s, {plan}, "
        f"{scale['voltage']:.3g} V, {scale['thrust']:.3g} N{with_channels}"
    ]
    if "bench" in truth:
        parts.append(f"bench {truth['bench']['name']}, loop at {truth['bench']['loop_rate']:g} Hz")
    for effect in truth["effects"]:
        told = ", ".join(
            f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in effect["parameters"].items()
        )
        parts.append(f"{effect['effect']}: {told}")
    if truth["fault"]:
        parts.append(", ".join(f"{k} {v}" for k, v in truth["fault"].items()))
    return "; ".join(parts)
