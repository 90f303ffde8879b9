"""The page on paper: the same HTML, set by WeasyPrint, which is an extra of the installation."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from rig.errors import ConfigError

MISSING = (
    "weasyprint sets the PDF and is not installed here: pip install 'thruster-rig[pdf]', or print the HTML page from a "
    "browser"
)

_PLAIN = re.compile(r"var\(--\w+, (#[0-9a-f]{6})\)")
"""A colour of a figure with the one it has on white paper: weasyprint knows no variables inside a figure."""


def require_pdf(option: str) -> None:
    """Raises ConfigError where the extra is not installed, before anything is computed."""
    if find_spec("weasyprint") is None:
        raise ConfigError(f"{option}: {MISSING}")


def write_pdf(page: str, path: Path) -> None:
    """The page's HTML as PDF, A4, tagged for screen readers. Raises ConfigError where it can't be, OSError."""
    try:
        weasyprint = import_module("weasyprint")
    except OSError as error:  # the extra is there, the system's Pango is not
        raise ConfigError(
            f"weasyprint is installed and finds no Pango on this system ({error}); install it (Debian: apt install "
            "libpango-1.0-0 libpangoft2-1.0-0), or print the HTML page from a browser"
        ) from error
    path.parent.mkdir(parents=True, exist_ok=True)
    weasyprint.HTML(string=_PLAIN.sub(r"\1", page), url_fetcher=_nothing).write_pdf(str(path), pdf_variant="pdf/ua-1")


def _nothing(url: str) -> dict[str, object]:
    """A page of ours fetches nothing, on paper neither."""
    raise ValueError(f"the page asks for {url[:80]!r}, and nothing is fetched")
