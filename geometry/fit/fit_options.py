"""Options of the search for sheets: what is asked of them, checked."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import GeometryError
from coneskin.core.text import suggest

from .touch_weights import TouchWeights

MOST_TOLERANCE = 0.020  #: m; a sheet that stands off further does not follow the link
_MOST_BRIDGE = 0.100  # m; over a wider hole a sheet sags
_SHEET_WIRES = 4  # of a sheet
_MOST_SHEETS = 100
_LEAST_SAMPLES, _MOST_SAMPLES = 100, 10_000_000
_MIN_DIRECTION_LENGTH = 1e-100  # of a direction, so that its square is neither 0 nor infinite


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What is asked of the sheets of a link.

    Attributes:
        tolerance: largest distance between a sheet and the hull [m].
        max_sheets: sheets at most.
        wrap: angle that a sheet must cover [rad]; None for what covers most, full wraps or partial ones. With less than
            a full turn, developables of another section than round are not looked for.
        min_length: smallest length of a sheet along its axis or its rulings [m].
        min_wrap: smallest partial wrap, the angle by which the normal turns [rad].
        max_bridge: width of the widest hole or groove that a sheet spans [m].
        seam_direction: direction in the link's frame in which the seam of a full wrap faces.
        samples: number of points on the mesh by which coverage is measured; the sheets do not depend on it.
        max_wires: wires at most, four for each sheet; None for as many as the sheets need.
        min_radius: smallest radius of a sheet [m]; a cone is covered up to there, not up to its apex.
        min_arc: smallest length of the narrow end of a sheet around the axis [m]; electrodes have to find room there.
        thickness: of a sheet [m]; sheets about different axes do not run into each other.
        gap: smallest distance between sheets about different axes, and between partial wraps [m].
        weights: what areas count, where touches are likelier on some than on others; None for all the same.
        exposure: True to weigh areas by how much of the space above them is free (``exposure_weights``).
        allow_hull: True where the visual mesh itself is convex: a mesh like a collision hull is not refused.

    Raises:
        GeometryError: a value is out of range.
    """

    tolerance: float = 0.001
    max_sheets: int = 2
    wrap: float | None = None
    min_length: float = 0.025
    min_wrap: float = math.radians(150.0)
    max_bridge: float = 0.010
    seam_direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    samples: int = 6000
    max_wires: int | None = None
    min_radius: float = 0.004
    thickness: float = 0.0062
    gap: float = 0.001
    weights: TouchWeights | None = None
    exposure: bool = False
    allow_hull: bool = False
    min_arc: float = 0.0

    def __post_init__(self) -> None:
        for name, most in (("tolerance", MOST_TOLERANCE), ("min_length", math.inf), ("max_bridge", _MOST_BRIDGE)):
            _check_length(name, getattr(self, name), most)
        _check_length("min_radius", self.min_radius, math.inf)
        for name in ("thickness", "gap", "min_arc"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise GeometryError(f"{name} must be finite and not negative, got {value * 1e3:g} mm")
        _check_count("max_sheets", self.max_sheets, 1, _MOST_SHEETS)
        _check_count("samples", self.samples, _LEAST_SAMPLES, _MOST_SAMPLES)
        if self.max_wires is not None:  # four for one sheet
            _check_count("max_wires", self.max_wires, _SHEET_WIRES, _SHEET_WIRES * _MOST_SHEETS)
        for name, angle in (("wrap", math.tau if self.wrap is None else self.wrap), ("min_wrap", self.min_wrap)):
            if not 0.0 < angle <= math.tau:
                raise GeometryError(
                    f"{name} must be above 0 and at most a full turn of 360 deg, got {math.degrees(angle):g} deg"
                )
        facing = tuple(self.seam_direction)
        if len(facing) != 3 or not _MIN_DIRECTION_LENGTH < math.hypot(*facing) < 1.0 / _MIN_DIRECTION_LENGTH:
            raise GeometryError(f"the direction of the seam must be three numbers, finite and not zero, got {facing}")
        if self.weights is not None and self.exposure:
            raise GeometryError("weights of touches come from a map or from the exposure, not from both")

    @property
    def most_sheets(self) -> int:
        """Number of sheets that may be used, by their number and by their wires."""
        return self.max_sheets if self.max_wires is None else min(self.max_sheets, self.max_wires // _SHEET_WIRES)

    @property
    def seam(self) -> Floats:
        """Unit vector in which the seam of a full wrap faces, shape (3,)."""
        facing = np.asarray(self.seam_direction, float)
        return np.asarray(facing / np.linalg.norm(facing))


def check_names(names: Iterable[str], more: tuple[str, ...] = ()) -> None:
    """Refuse names that are no option of the search, nor one of ``more``.

    Raises:
        GeometryError: with the nearest name.
    """
    known = [*(item.name for item in fields(FitOptions)), *more]
    for name in names:
        if name not in known:
            raise GeometryError(f"{name} is no option of the search for sheets; {suggest(name, sorted(known))}")


def _check_count(name: str, value: int, least: int, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise GeometryError(f"{name} must be a whole number from {least} to {most}, got {value!r}")


def _check_length(name: str, value: float, most: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise GeometryError(f"{name} must be above 0 mm, got {value * 1e3:g} mm")
    if value > most:
        raise GeometryError(f"{name} must be at most {most * 1e3:g} mm, got {value * 1e3:g} mm")
