"""Lines of a model as a person types them in: pieces that several terms write.

Python with numpy's names; `d(a)/dt = ..., a(0) = ...` is a differential equation with its value where the run begins,
and `delayed`, `play`, `since_opposite`, `since_turned`, `clipped_mean` and `curve` say beside them what they are.
"""

from __future__ import annotations


def follows(state: str, what: str, time_constant: float, begin: str = "0") -> str:
    """A state that follows something with a time constant in s.

    >>> follows("x", "V", 0.12, "V(0)")
    'd(x)/dt = (V - x) / 0.12, x(0) = V(0)'
    """
    return f"d({state})/dt = ({what} - {state}) / {time_constant:.6g}, {state}(0) = {begin}"


def signed(value: float) -> str:
    """A number that is added.

    >>> signed(0.25), signed(-0.25)
    ('+ 0.25', '- 0.25')
    """
    return f"{'-' if value < 0 else '+'} {abs(value):.6g}"
