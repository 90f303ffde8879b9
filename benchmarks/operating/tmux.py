"""Terminals of a tmux server of its own: keys go in as somebody types them, what stands on the screen comes out."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import TracebackType

COLUMNS, ROWS = 120, 40
SHELL = "bash --noprofile --norc -i"


def there_is_tmux() -> bool:
    return shutil.which("tmux") is not None


class Tmux:
    """The server lives as long as the context, on a socket that nobody else uses."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="tmux-")  # a socket's path has to be short
        self._socket = str(Path(self._folder.name) / "socket")

    def __enter__(self) -> Tmux:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        subprocess.run(["tmux", "-S", self._socket, "kill-server"], capture_output=True, check=False)
        self._folder.cleanup()

    def call(self, *words: str) -> str:
        """Output of one tmux command."""
        done = subprocess.run(
            ["tmux", "-S", self._socket, "-f", os.devnull, *words], capture_output=True, text=True, check=True
        )
        return done.stdout

    def window(self, name: str, folder: Path) -> Window:
        """A new terminal with a shell in `folder`, whose prompt is `name$`; its `rig` and `python` are ours."""
        words = {"PS1": f"{name}$ ", "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        words |= {"HISTFILE": "", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        shell = f"env {' '.join(f'{key}={shlex.quote(value)}' for key, value in words.items())} {SHELL}"
        size = ("-x", str(COLUMNS), "-y", str(ROWS))
        self.call("new-session", "-d", "-s", name, *size, "-c", str(folder), shell)
        return Window(self, name)


class Window:
    """One terminal."""

    def __init__(self, tmux: Tmux, name: str) -> None:
        self._tmux, self.name = tmux, name

    def press(self, *keys: str) -> None:
        """Keys by tmux's names: `F5`, `Enter`, `C-u`, `n`."""
        self._tmux.call("send-keys", "-t", self.name, *keys)

    def type(self, letters: str) -> None:
        """Letters as they are, in one burst."""
        self._tmux.call("send-keys", "-t", self.name, "-l", "--", letters)

    def screen(self) -> str:
        """The lines that stand there now; one that a shell's output has wrapped is one."""
        lines = self._tmux.call("capture-pane", "-p", "-J", "-t", self.name).splitlines()
        return "\n".join(line.rstrip() for line in lines)

    def colored(self) -> str:
        """The same with its colours: where the focus is."""
        return self._tmux.call("capture-pane", "-p", "-e", "-t", self.name)

    def cursor_line(self) -> str:
        """The line where the cursor stands."""
        row = int(self._tmux.call("display-message", "-p", "-t", self.name, "#{cursor_y}"))
        lines = self._tmux.call("capture-pane", "-p", "-t", self.name).splitlines()
        return lines[row] if row < len(lines) else ""
