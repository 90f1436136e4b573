"""Plot of traces in a page's panel, with the choice of what is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .strand import Strand
from .traces import Traces, trace_names, traces

__all__ = ["COLOURS", "MOST_LINES", "TracePlot", "value_range"]

#: of the lines, in their order
COLOURS = ("#2563eb", "#ea580c", "#16a34a", "#7c3aed", "#854d0e", "#0891b2", "#db2777", "#4b5563")
MOST_LINES = 12  #: of one plot


class TracePlot:
    """Plot of runs.

    Args:
        gui: viser's ``GuiApi``.
        strands: the runs.
        since: from when on, on the page's clock [s].
        until: until when.
        fixed: touch levels alone are drawn, and nobody can choose: on a page that all viewers share.
    """

    def __init__(self, gui: Any, strands: Sequence[Strand], since: float, until: float, fixed: bool = False) -> None:
        self._gui, self._strands, self._since, self._until = gui, strands, since, until
        names = self._names = trace_names(strands)
        self._folder = gui.add_folder("traces")
        self._shown = names[0]
        with self._folder:
            choice = None if fixed else gui.add_dropdown("show", names, initial_value=names[0])
            self._plot = self._make()
        if choice is not None:
            choice.on_update(lambda _event: self._change(str(choice.value)))

    def move(self, since: float, until: float) -> None:
        """Draw another stretch of time."""
        self._since, self._until = since, until
        found = self._traces()
        self._plot.data, self._plot.scales = (found.times, *found.values), _scales(found)

    def remove(self) -> None:
        """Take the plot off the page."""
        self._folder.remove()

    def _change(self, what: str) -> None:
        if what not in self._names or what == self._shown:
            return
        old, self._shown = self._plot, what
        with self._folder:
            self._plot = self._make()
        old.remove()

    def _traces(self) -> Traces:
        found = traces(self._strands, self._shown, self._since, self._until)
        return Traces(found.names[:MOST_LINES], found.times, found.values[:MOST_LINES])

    def _make(self) -> Any:
        found = self._traces()
        series = [{"label": "time [s]"}]
        for number, name in enumerate(found.names):
            series.append({"label": name, "stroke": COLOURS[number % len(COLOURS)], "width": 1.5})  # type: ignore[dict-item]
        return self._gui.add_uplot(
            (found.times, *found.values),
            tuple(series),
            scales=_scales(found),
            legend={"show": True},
            aspect=1.7,
        )


def value_range(found: Traces) -> tuple[float, float]:
    """Return from where to where the values of traces are drawn, with a margin; 0 to 1 where there are none."""
    import numpy as np

    known = found.values[np.isfinite(found.values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    margin = 0.05 * (high - low) or 0.5
    return low - margin, high + margin


def _scales(found: Traces) -> dict[str, Any]:
    """Return the axes of a plot; one that looks for its own range finds none where a value is missing (NaN)."""
    return {"x": {"time": False, "auto": True}, "y": {"auto": False, "range": value_range(found)}}
