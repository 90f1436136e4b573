"""Scale of touch levels: the colour of a sheet, and the bar beside the scene that says what the colours mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from .stage import SheetSurface

_COLOUR_STEPS = 24  # colours of a sheet: a change below one is not worth a message
#: quiet, touched and firm: from dark to bright, each with a contrast of 3 and more to the one before, to any eye
SHEET_COLOURS = (12, 44, 74), (214, 70, 224), (255, 248, 200)
_FIRM_LEVEL = 0.6
_GRADIENT_STOPS = 16  # of a bar's gradient
_MAX_FORCE_TICKS = 4  # of a force table that have a tick


def level_colour(level: float, touch_level: float) -> tuple[int, int, int]:
    """Return the colour of a sheet: quiet below its touch level, then from touched to firm."""
    if level < touch_level:
        low, high, share = *SHEET_COLOURS[:2], 0.4 * max(level, 0.0) / touch_level
    else:
        low, high = SHEET_COLOURS[1:]
        share = min(1.0, (level - touch_level) / max(_FIRM_LEVEL - touch_level, 1e-3))
    share = round(share * _COLOUR_STEPS) / _COLOUR_STEPS
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def gradient(colours: Sequence[tuple[int, int, int]]) -> str:
    """Return a style sheet's gradient through colours at equal distances."""
    last = len(colours) - 1
    stops = (f"rgb({r},{g},{b}) {100.0 * k / last:.1f}%" for k, (r, g, b) in enumerate(colours))
    return f"linear-gradient(to right,{','.join(stops)})"


def level_words(sheet: SheetSurface, level: float) -> str:
    """Return a level for people, with the force that the sensor's calibration knows for it."""
    text = f"{sheet.name}: level {level:.2f}"
    table = sheet.sensor.force_table
    if table is None or level < table.levels[0]:
        return text
    if (force := table.force(level)) is None:
        return f"{text}, above {table.forces[-1]:.3g} N"
    return f"{text}, {force[0]:.3g} +- {force[1]:.2g} N"


def level_bars(
    sheets: Sequence[SheetSurface], levels: Mapping[str, float], force: float | None = None, title: str = ""
) -> str:
    """Return a bar for each sheet: what its colours mean, and the level at this moment.

    Args:
        levels: by the names of the sheets.
        force: between the arm and what it meets, where physics knows it [N].
        title: above the bars: whose they are, of several runs.
    """
    parts = [f"<b>{escape(title)}</b>"] if title else []
    parts += [_bar(sheet, levels[sheet.name]) for sheet in sheets]
    if force is not None:
        parts.append(f'<div class="coneskin-force">force of the contact, in physics: <b>{force:.1f} N</b></div>')
    return f'<div id="coneskin-levels">{"".join(parts)}</div>'


def _bar(sheet: SheetSurface, level: float) -> str:
    colours = [level_colour(k / _GRADIENT_STOPS, sheet.touch_level) for k in range(_GRADIENT_STOPS + 1)]
    shown = 100.0 * min(max(level, 0.0), 1.0)
    ticks = [(sheet.touch_level, f"{sheet.touch_level:g}")]
    if (table := sheet.sensor.force_table) is not None:
        every = max(1, -(-len(table.forces) // _MAX_FORCE_TICKS))
        ticks += [(at, f"{force:.3g} N") for at, force in list(zip(table.levels, table.forces, strict=True))[::every]]
    else:
        ticks += [(0.5, "0.5"), (1.0, "1")]
    marks = "".join(
        f'<span style="position:absolute;left:{100.0 * at:.1f}%;transform:translateX(-{100.0 * at:.0f}%)">{text}</span>'
        for at, text in ticks
    )
    return (
        f'<div class="coneskin-level">{escape(level_words(sheet, level))}</div>'
        f'<div style="position:relative;height:10px;background:{gradient(colours)}">'
        f'<div class="coneskin-level-mark" style="position:absolute;left:{shown:.1f}%;top:-2px;width:3px;height:14px;'
        'margin-left:-1px;background:#111827"></div></div>'
        f'<div style="position:relative;height:14px;font-size:10px;opacity:.8">{marks}</div>'
    )
