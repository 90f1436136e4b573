"""Contrast of the page's colors for normal, protan and deutan eyes, before they were chosen for them and now.

    python -m bench view-colors

Each pair must be told apart: neighbors in the scale of a sheet, phases of the guard, and a mark on its sheet. Ratios of
contrast by WCAG 2.2, of colors that a simulation of an eye without one kind of cone has changed.
"""

from __future__ import annotations

from bench.report import head, show
from coneskin.view.run_course import PHASE_COLOURS
from coneskin.view.stage.level_scale import SHEET_COLOURS
from coneskin.view.stage_nodes import LOCATED
from tests.support.eyes import EYES, contrast


def hex_color(text: str) -> tuple[int, ...]:
    """Red, green and blue of #rrggbb."""
    return tuple(bytes.fromhex(text[1:]))


PAIRS = {
    "sheet: quiet, touched": (SHEET_COLOURS[0], SHEET_COLOURS[1]),
    "sheet: touched, firm": (SHEET_COLOURS[1], SHEET_COLOURS[2]),
    "mark, quiet sheet": (LOCATED, SHEET_COLOURS[0]),
    "phase: active, moving": (hex_color(PHASE_COLOURS["active"]), hex_color(PHASE_COLOURS["moving"])),
    "phase: active, stopped": (hex_color(PHASE_COLOURS["active"]), hex_color(PHASE_COLOURS["stopped"])),
    "phase: moving, stopped": (hex_color(PHASE_COLOURS["moving"]), hex_color(PHASE_COLOURS["stopped"])),
}
_ACTIVE, _MOVING, _STOPPED = map(hex_color, ("#15803d", "#b45309", "#b91c1c"))
#: the same pairs as they were at 9b9811f
BEFORE = {
    "sheet: quiet, touched": ((46, 125, 107), (245, 158, 11)),
    "sheet: touched, firm": ((245, 158, 11), (220, 38, 38)),
    "mark, quiet sheet": ((192, 38, 211), (46, 125, 107)),
    "phase: active, moving": (_ACTIVE, _MOVING),
    "phase: active, stopped": (_ACTIVE, _STOPPED),
    "phase: moving, stopped": (_MOVING, _STOPPED),
}


def main() -> None:
    """Print the ratios."""
    print(head())
    columns = ["", *(f"{eye}, {when}" for eye in EYES for when in ("before", "now"))]
    rows = [
        [name, *(f"{contrast(*pairs[name], eye):.2f}" for eye in EYES for pairs in (BEFORE, PAIRS))] for name in PAIRS
    ]
    show("ratio of contrast (wanted: 3)", columns, rows)
    print(f"least: {min(contrast(*pair, eye) for pair in BEFORE.values() for eye in EYES):.2f} before, "
          f"{min(contrast(*pair, eye) for pair in PAIRS.values() for eye in EYES):.2f} now")  # fmt: skip


if __name__ == "__main__":
    main()
