"""Part of the tests on the newest Python that this machine has, where that is newer than the one that runs this.

    python tests/newest_python.py [--every N]

It gets an environment of its own in build/, of the same pinned packages. Every module is imported there, and each so
manieth file of tests that need not be alone is run: what a newer Python breaks is seldom in one test alone. Without
one nothing is done, and that is said.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
NEWEST = 20
"""Minor version up to which one is looked for by name."""
ASK = "import sys, ensurepip; print(sys.version_info.releaselevel, *sys.version_info[:2])"
MODULES = """
import importlib, pkgutil, sys
for name in ("rig", "drivers", "identification", "sim_devices"):
    package = importlib.import_module(name)
    for module in pkgutil.walk_packages(package.__path__, name + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
"""
SLOW = ("tests/identification", "tests/concealed", "tests/rig/blind")
"""They compute with numpy, and ask nothing of Python's own library."""


def candidates() -> Iterator[str]:
    yield from (f"python3.{minor}" for minor in range(sys.version_info.minor + 1, NEWEST))
    yield from map(str, Path.home().glob(".pyenv/versions/3.*/bin/python"))


def version(python: str) -> tuple[int, ...]:
    """Major and minor of a released one that can make environments; nothing of what is none."""
    try:
        told = subprocess.run([python, "-c", ASK], capture_output=True, text=True, check=False, timeout=60)
    except OSError:
        return ()
    level, *numbers = told.stdout.split() or [""]
    return tuple(map(int, numbers)) if level == "final" else ()


def environment(python: str, name: str) -> Path:
    """Its interpreter, with the project and what its tests need."""
    folder = PROJECT / "build" / f"python-{name}"
    interpreter = folder / "bin" / "python"
    subprocess.run([python, "-m", "venv", "--clear", folder], check=True)
    install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "-c",
        "constraints.txt",
        "-e",
        ".[test]",
    ]
    subprocess.run([interpreter, *install], check=True, cwd=PROJECT)
    return interpreter


def some_tests(every: int) -> list[str]:
    files = sorted(str(path.relative_to(PROJECT)) for path in PROJECT.glob("tests/**/test_*.py"))
    return [file for file in files if not file.startswith(SLOW)][::every]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=5, help="1: all of them")
    asked = parser.parse_args()
    newest = max(candidates(), key=version, default="")
    found, own = version(newest) if newest else (), sys.version_info[:2]
    if found <= own:
        print(f"no Python newer than {own[0]}.{own[1]} is here: nothing to try")
        return 0
    interpreter = environment(newest, ".".join(map(str, found)))
    subprocess.run([interpreter, "-W", "error::SyntaxWarning", "-c", MODULES], check=True, cwd=PROJECT)
    how = ["-q", "-n", "2", "--dist", "worksteal", "-m", "not alone", "-p", "no:cacheprovider"]
    words = [interpreter, "-m", "pytest", *how, *some_tests(asked.every)]
    done = subprocess.run(words, check=False, cwd=PROJECT, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
    verdict = "fails" if done.returncode else "all well"
    print(f"Python {'.'.join(map(str, found))}, one test file of {asked.every}: {verdict}")
    return done.returncode


if __name__ == "__main__":
    raise SystemExit(main())
