"""Drawing of the phases of a guard with an arm, from the table of transitions in robot/guard/phase.py.

    python scripts/draw_guard_phases.py        writes docs/images/guard-phases.svg

tests/test_docs.py compares the drawing with the file that is committed. Cues that change no phase are left out.
"""

from __future__ import annotations

import math
from pathlib import Path

from coneskin.robot.guard.phase import TRANSITIONS, Act, Phase

TARGET = Path(__file__).parents[1] / "docs" / "images" / "guard-phases.svg"
WIDTH, HEIGHT = 960, 610  # px
BOX = 150, 44  # px
#: middle of each box [px]
PLACES = {
    Phase.STARTING: (110, 50),
    Phase.ACTIVE: (430, 50),
    Phase.SLOWED: (820, 50),
    Phase.STOPPING: (430, 220),
    Phase.PLACING: (820, 220),
    Phase.LATCHED: (110, 390),
    Phase.STANDING: (430, 390),
    Phase.RETREATING: (820, 390),
    Phase.HALTING: (430, 560),
}
COLOURS = {Act.STOP: "#c0392b", Act.HALT: "#c0392b", Act.ACTIVATE: "#1f6fb2", Act.LATCH: "#455a64", Act.NONE: "#455a64"}
SHIFT = 12  # px to the right of an arrow's direction, so that the way back is another line
STYLE = "text { font-family: Helvetica, Arial, sans-serif; font-size: 12px; } .box { font-size: 14px; }"


def edge(middle: tuple[float, float], towards: tuple[float, float]) -> tuple[float, float]:
    """Return where a line from the middle of a box leaves it."""
    x, y = towards[0] - middle[0], towards[1] - middle[1]
    share = min(0.5 * BOX[0] / abs(x) if x else math.inf, 0.5 * BOX[1] / abs(y) if y else math.inf)
    return middle[0] + share * x, middle[1] + share * y


def arrow(here: Phase, there: Phase, words: str, act: Act) -> list[str]:
    """Return an arrow between two boxes with its words."""
    a, b = PLACES[here], PLACES[there]
    (x0, y0), (x1, y1) = edge(a, b), edge(b, a)
    length = math.hypot(x1 - x0, y1 - y0)
    right = SHIFT * (y0 - y1) / length, SHIFT * (x1 - x0) / length
    x0, y0, x1, y1 = x0 + right[0], y0 + right[1], x1 + right[0], y1 + right[1]
    upright = abs(x1 - x0) < 1.0
    at = 0.5 if upright or y0 == y1 else 0.26
    x, y = x0 + at * (x1 - x0) + (math.copysign(6, x0 - a[0]) if upright else 0.0), y0 + at * (y1 - y0)
    anchor = ("start" if x0 > a[0] else "end") if upright else "middle"
    colour = COLOURS[act]
    line = (
        f'<path d="M {x0:.1f} {y0:.1f} L {x1:.1f} {y1:.1f}" stroke="{colour}" stroke-width="2" marker-end="url(#h)"/>'
    )
    halo = 'paint-order="stroke" stroke="#fff" stroke-width="4"'
    return [line, f'<text x="{x:.1f}" y="{y + 4:.1f}" fill="{colour}" text-anchor="{anchor}" {halo}>{words}</text>']


def drawing() -> str:
    """Return the SVG."""
    arrows: dict[tuple[Phase, Phase], list[tuple[str, Act]]] = {}
    for (here, cue), (there, act) in TRANSITIONS.items():
        if here is not there:
            arrows.setdefault((here, there), []).append((cue.value, act))
    lines, (width, height) = [], BOX
    for phase, (x, y) in PLACES.items():
        frame = f'x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width}" height="{height}" rx="8"'
        lines.append(f'<rect {frame} fill="#f4f6f8" stroke="#455a64"/>')
        lines.append(f'<text x="{x}" y="{y + 5}" class="box" text-anchor="middle">{phase.value}</text>')
    for (here, there), cues in arrows.items():
        lines += arrow(here, there, " / ".join(cue for cue, _ in cues), cues[0][1])
    marker = '<marker id="h" markerWidth="8" markerHeight="8" refX="6" refY="3" orient="auto">'
    head = f'<defs>{marker}<path d="M 0 0 L 6 3 L 0 6 z" fill="context-stroke"/></marker></defs><style>{STYLE}</style>'
    frame = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}">'
    return "\n".join([frame, head, *lines, "</svg>"]) + "\n"


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8")
