"""How far a collar can be turned on its link before its lip meets a part of it: what places it around the link."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.solid.radial_profile import without_undercut

from .link_excess import LinkExcess

__all__ = ["lip_play"]

Floats = NDArray[np.float64]

_ROWS = 61  # along the lip
_MOST = 12  # columns of a degree; a collar that can be turned further does not show its azimuth


def lip_play(
    link: LinkExcess,
    lips: Sequence[tuple[Floats, Floats, NDArray[np.bool_]]],
    wanted: float,
    clearance: float,
    facets: float = 0.0,
) -> float | None:
    """Return the angle between the two positions in which a collar meets its link [rad]; None where there are none.

    The collar stays about the axis of its sheet, but for a shift by the clearance. Facets are the mesh's, not the
    link's: a collar that is held by nothing else does not show its azimuth.

    Args:
        link: beside the end of the sheet.
        lips: of the parts: azimuths of the columns, evenly [rad]; lengths of the lip there [m]; where tabs leave.
        wanted: length of a lip where nothing is in its way [m].
        clearance: gap between lip and link [m].
        facets: height of the corners of the mesh above its facets [m].
    """
    share = np.linspace(0.0, 1.0, _ROWS)
    ways = [_MOST + 1, _MOST + 1]
    for phi, lengths, tabs in lips:
        excess = link.over(share, np.full(len(phi), wanted), phi, 0.0)
        cone = link.cone(link.height(share * wanted))[:, None]
        inside = without_undercut(cone + excess + clearance, phi) + max(clearance, facets)
        inside = np.where((share[:, None] * wanted <= lengths) & ~tabs, inside, np.inf)
        radius = cone + excess
        for way, (held, met) in enumerate(((inside, radius), (inside[:, ::-1], radius[:, ::-1]))):
            for columns in range(1, ways[way]):
                if (met[:, columns:] > held[:, :-columns]).any():
                    ways[way] = columns
                    break
    width = float(lips[0][0][1] - lips[0][0][0])
    return None if max(ways) > _MOST else sum(ways) * width
