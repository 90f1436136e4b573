"""Drawing of all traces of runs (SVG), with the choice of one: for a page in a file, which has nothing that plots."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from .strand import Strand
from .trace_plot import COLOURS, MOST_LINES, value_range
from .traces import Traces, trace_names, traces

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["trace_drawings"]

_WIDTH, _HEIGHT = 480.0, 120.0  # units of the drawing, which fills the panel


def trace_drawings(strands: Sequence[Strand], since: float, until: float) -> str:
    """Return a choice of traces and the drawing of each, of which all but the first are hidden.

    Args:
        strands: the runs.
        since: from when on, on the page's clock [s].
        until: until when.
    """
    names = trace_names(strands)
    options = "".join(f'<option value="{number}">{escape(name)}</option>' for number, name in enumerate(names))
    drawings = [_drawing(traces(strands, name, since, until)) for name in names]
    hidden = ["", *[" hidden"] * (len(names) - 1)]
    drawn = "".join(f'<div class="coneskin-trace"{a}>{b}</div>' for a, b in zip(hidden, drawings, strict=True))
    return f'<div id="coneskin-traces"><label>traces <select>{options}</select></label>{drawn}</div>'


def _drawing(found: Traces) -> str:
    low, high = value_range(found)
    span = float(found.times[-1] - found.times[0])
    x = (found.times - found.times[0]) / max(span, 1e-9) * _WIDTH
    lines, words = [], []
    for name, values, colour in zip(found.names, found.values, _colours(len(found.names)), strict=False):
        course = _course(x, (high - values) / (high - low) * _HEIGHT)
        lines.append(f'<path d="{course}" fill="none" stroke="{colour}" vector-effect="non-scaling-stroke"/>')
        words.append(f'<span style="color:{colour}">&#9644;</span> {escape(name)}')
    return (
        f'<div style="position:relative"><svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none" '
        f'style="display:block;width:100%;height:{_HEIGHT:g}px;background:#f9fafb">{"".join(lines)}</svg>'
        f'<span style="position:absolute;left:2px;top:0">{high:.3g}</span>'
        f'<span style="position:absolute;left:2px;bottom:0">{low:.3g}</span><div class="coneskin-cursor"></div></div>'
        f"<div>{', '.join(words)}</div>"
    )


def _colours(count: int) -> list[str]:
    return [COLOURS[number % len(COLOURS)] for number in range(min(count, MOST_LINES))]


def _course(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    """Return the data of a path with a gap wherever there is no value."""
    import numpy as np

    words, drawing = [], False
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        if not np.isfinite(down):
            drawing = False
            continue
        words.append(f"{'L' if drawing else 'M'}{across:.1f} {down:.1f}")
        drawing = True
    return "".join(words)
