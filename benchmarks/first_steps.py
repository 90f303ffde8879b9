"""From a wheel in an empty folder to a finished campaign, with the commands that docs and `rig init` name, typed.

    make wheel && python benchmarks/first_steps.py build/wheel/*.whl [-c constraints.txt] [--keep FOLDER]

A shell on a pseudo-terminal, in a new folder outside of the repository, a virtual environment of its own: install,
`rig init`, the simulated bench, `rig check`, `rig run` (F5 in the console, `d` at its end), `rig fit`, `rig list`.
Prints the transcript without the console's screens, and how long each command took. Without the extra `serve`,
`rig console --serve` must say in one sentence what is missing. The status is the number of commands that ended
otherwise than they should.
"""

from __future__ import annotations

import argparse
import re
import select
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.rig.console.terminal import Terminal, on_terminal

SHELL = "import os; os.environ['PS1'] = '$ '; os.execvp('bash', ['bash', '--norc', '--noprofile', '-i'])"
DONE = "status"
ENDED = "COMPLETED|TRIPPED|ABORTED"
AFTER = "thrust = C V|V| + tare; C in"
ESCAPES = re.compile(r"\x1b\[[0-9;?<>=]*[ -/]*[@-~]|\x1b[()][A-Z0-9]|\x1b[=>78]|\x1b\][^\x07]*\x07|\r|\x07")
F5 = b"\x1b[15~"


@dataclass
class Shell:
    """What is typed, and what came."""

    terminal: Terminal
    failed: int = 0
    count: int = 0

    def type(self, command: str, *, status: int = 0, timeout: float = 600.0) -> str:
        """What the command said. Its exit status is asked for with `echo`, as a person would."""
        seen, begun = len(self.terminal.lines), time.monotonic()
        self.count += 1
        mark = f"{DONE} {self.count}:"
        self.terminal.press(f"{command}\n".encode())
        self.during(command)
        self.terminal.press(f"echo '{DONE}' {self.count}:$?\n".encode())
        self.until(mark, seen, timeout)
        said = ESCAPES.sub("", self.terminal.lines[seen:])
        body, _, rest = said.rpartition(mark)
        found = int(rest.split()[0])
        lines = [line for line in body.split("\n")[1:] if f"echo '{DONE}'" not in line and line != "(rig-env)"]
        print(f"$ {command}\n{after_the_console(chr(10).join(lines))}".rstrip(" $\n"))
        print(f"    (status {found}, {time.monotonic() - begun:.1f} s)\n", flush=True)
        self.failed += found != status
        return body

    def during(self, command: str) -> None:
        """The keys of the console: start once the checks have passed, leave at the end."""
        if command.startswith("rig run"):
            seen = len(self.terminal.lines)
            self.until("Press F5 to start", seen, 120.0)
            self.terminal.press(F5)
            self.until(ENDED, seen, 600.0)
            select.select([], [], [], 1.0)
            self.terminal.press(b"d")
            self.until("recordings, fits and logs", seen, 120.0)
        if "sim_devices" in command:
            self.until("ready", len(self.terminal.lines), 60.0)

    def until(self, text: str, seen: int, timeout: float) -> None:
        """Wait for it (a regular expression) to be written after the first `seen` characters."""
        deadline = time.monotonic() + timeout
        while not re.search(text, self.terminal.lines[seen:]):
            if time.monotonic() > deadline:
                raise TimeoutError(f"{text!r} was waited for {timeout:g} s; newest: {self.terminal.lines[-1500:]}")
            select.select([], [], [], 0.1)


def after_the_console(text: str) -> str:
    """What the console has left on the terminal."""
    place = text.find(AFTER)
    return f"[the console: F5, later d]\n{text[place:]}" if place > 0 and "STOP" in text[:place] else text


def main() -> int:
    """The number of commands that ended otherwise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("-c", "--constraints", type=Path, help="for pip")
    parser.add_argument("--keep", type=Path, help="a new folder to work in, which is kept")
    asked = parser.parse_args()
    with TemporaryDirectory() as scratch, on_terminal(SHELL, size=(120, 40)) as (process, terminal):
        place = (asked.keep or Path(scratch) / "desk").resolve()
        place.mkdir(parents=True)
        shell = Shell(terminal)
        pins = f"-c {asked.constraints.resolve()} " if asked.constraints else ""
        for command in (
            f"cd {place} && ls -A",
            f"{sys.executable} -m venv rig-env && . rig-env/bin/activate",
            f"pip install --quiet --disable-pip-version-check {pins}{asked.wheel.resolve()}",
            "rig init my-bench",
            "cd my-bench",
            "python -m sim_devices world.toml &",
            "rig check campaign.toml",
            "rig run campaign.toml",
            "rig fit recordings/first-*/T2.h5",
            "ls recordings/first-*",
            "rig list recordings",
        ):
            shell.type(command)
        shell.type("rig console --serve", status=2)
        shell.type("kill %1")
        terminal.press(b"exit\n")
        process.wait(20.0)
    return shell.failed


if __name__ == "__main__":
    sys.exit(main())
