"""Where a recording and a model disagree, what physics was left out, and how much better the model is with it.

from identification.mismatch import diagnose
found = diagnose(recordings)        # a Diagnosis, or a Refusal that says what is wrong with the recordings
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.mismatch.pipeline import diagnose

__all__ = ["diagnose"]


def __getattr__(name: str) -> Any:
    """`diagnose`, loaded when it is asked for: the watch of a running campaign needs a small part of this package."""
    if name == "diagnose":
        from identification.mismatch.pipeline import diagnose

        return diagnose
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
