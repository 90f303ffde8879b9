"""A function by its name, as it crosses to other processes."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def called(place: str) -> Any:
    """What a `module:function` is; the module is imported."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
