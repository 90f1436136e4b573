"""Bare areas beside developable sheets, each with the reason."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.fit.bare_areas import BareArea, BareTally, flat_samples, sheet_more
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.fit.fitted_sheet import FittedSheet
from coneskin.geometry.fit.surface_samples import SurfaceSamples

from .found_sheet import covered_by

__all__ = ["bare_beside"]


def bare_beside(
    sheets: Sequence[FittedSheet],
    more: Sequence[FittedSheet],
    earlier: Sequence[BareArea],
    hull: SurfaceSamples,
    options: FitOptions,
) -> tuple[BareArea, ...]:
    """Return what sheets leave bare, by reason, the largest area first.

    Args:
        sheets: the sheets.
        more: what could be added if one more were allowed.
        earlier: bare areas of the same samples before the last of the sheets were found; their reasons still hold.
        hull: samples of the link.
        options: of the search.
    """
    tally = BareTally(hull, covered_by(sheets, hull, options.tolerance))
    take = tally.take
    if more:
        take(sheet_more(len(sheets)), covered_by(more, hull, options.tolerance))
    for area in earlier:
        take(area.reason, _among(hull, area))
    take("flat", flat_samples(hull))
    least = f"{options.min_length * 1e3:g} mm long and {math.degrees(options.min_wrap):g} deg wide"
    take(f"curved in two ways, in a corner, or without room for a sheet {least}", np.ones(len(hull), bool))
    return tuple(tally.areas)


def _among(hull: SurfaceSamples, area: BareArea) -> NDArray[np.bool_]:
    """Return whether each sample is one of an area, shape (n,)."""
    inside = set(map(tuple, area.points.tolist()))
    return np.fromiter((tuple(point) in inside for point in hull.points.tolist()), bool, len(hull))
