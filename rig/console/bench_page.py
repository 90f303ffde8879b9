"""Page 7: the devices of the bench, a paragraph each, and the limits that the guard keeps."""

from __future__ import annotations

from rig.console.panels import Panel
from rig.console.view_model.bench_text import bench_text
from rig.console.view_model.view import View


class BenchPanel(Panel):
    """Draws only while its page is shown: ages change with every snapshot."""

    def show(self, view: View) -> None:
        text = bench_text(view)
        self.put((text.plain, view.condition), text)
