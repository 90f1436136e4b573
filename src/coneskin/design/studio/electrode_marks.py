"""Marks of the four electrodes on a link: their middle lines, and where their letters stand."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.design.sheets.sheet_design import SheetDesign

__all__ = ["ELECTRODE_COLOURS", "ElectrodeMark", "electrode_marks"]

ELECTRODE_COLOURS = {"A": (220, 38, 38), "B": (217, 119, 6), "C": (37, 99, 235), "D": (13, 148, 136)}
_LINE_ABOVE = 0.001  # m above the side
_LETTER_ABOVE = 0.006  # m: in front of its line from wherever the line is seen
_PIECES = {"A": 89, "B": 89, "C": 19, "D": 19}
_LETTERS = {"A": (0.1, 0.43, 0.76), "B": (0.1, 0.43, 0.76), "C": (0.5,), "D": (0.5,)}  # shares of the line


class ElectrodeMark(NamedTuple):
    """Mark of one electrode.

    Attributes:
        letter: its name, A to D.
        segments: of its middle line [m], shape (n, 2, 3).
        letters: where its letter stands [m], shape (k, 3); of a ring more than once, so that one is in front.
    """

    letter: str
    segments: NDArray[np.float32]
    letters: NDArray[np.float64]


def electrode_marks(design: SheetDesign) -> list[ElectrodeMark]:
    """Return the marks of a sheet's electrodes, on the side that it covers."""
    import numpy as np

    side, box, half = design.place.frustum, design.layout.field, 0.5 * design.layout.plan.electrode
    turn = half / min(side.radius1, side.radius2)
    found = []
    for letter, pieces in _PIECES.items():
        share = np.linspace(0.0, 1.0, pieces + 1)
        stands = np.array(_LETTERS[letter])

        def place(at: NDArray[np.float64], above: float, letter: str = letter) -> NDArray[np.float64]:
            u = {"A": box.u2 + half, "B": box.u1 - half}.get(letter, box.u1 + at * (box.u2 - box.u1))
            phi = {"C": box.phi2 + turn, "D": box.phi1 - turn}.get(letter, box.phi1 + at * (box.phi2 - box.phi1))
            points, normals = design.place.place(*np.broadcast_arrays(u, phi + 0.0 * at))
            return np.asarray(points + above * normals)

        line = place(share, _LINE_ABOVE).astype("float32")
        found.append(ElectrodeMark(letter, np.stack([line[:-1], line[1:]], axis=1), place(stands, _LETTER_ABOVE)))
    return found
