"""Drivers that stand on a library of an extra: loaded when a bench builds one, so that the base install stays light."""

from __future__ import annotations

from collections.abc import Callable

from drivers.protocols import Instrument


class MissingExtra(Exception):
    """A bench asks for a device whose library is not installed; the sentence names the extra."""


def of_extra(extra: str, library: str, load: Callable[[], Callable[..., Instrument]]) -> Callable[..., Instrument]:
    """The `build` of a Kind: `load` imports the driver, which imports `library`.

    Raises MissingExtra where that is not installed.
    """

    def build(*arguments: object) -> Instrument:
        try:
            made = load()
        except ModuleNotFoundError as error:
            if error.name is None or error.name.split(".")[0] != library:
                raise
            raise MissingExtra(
                f"this kind of device needs the Python package {library}, which is not installed:"
                f" pip install 'thruster-rig[{extra}]'"
            ) from error
        return made(*arguments)

    return build
