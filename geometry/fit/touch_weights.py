"""Weights of touches on a link: how much an area counts, by a map of the user's or by what can be touched at all."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coneskin.core.arrays import Floats, frozen
from coneskin.core.errors import GeometryError
from coneskin.core.files import read_text
from coneskin.geometry.ray_casting import RayCaster

from .cone_fit import perpendicular_vectors
from .surface_samples import SurfaceSamples

LEAST_WEIGHT = 1e-3  #: of the largest; where nothing touches, a sheet may still lie, and it is worth nearly nothing
_MAP_COLUMNS = ("x_mm", "y_mm", "z_mm", "weight")
_MAX_SIZE = 50_000_000  # bytes of a map; a million places
_MAX_COORDINATE = 10_000.0  # mm of a coordinate, as in a scene
_RAY_COUNT = 32  # from each sample of the hull
_FINGER_LIFT = 0.002  # m; a fingertip above the surface, not in its seams and grooves


@dataclass(frozen=True, slots=True, eq=False)
class TouchWeights:
    """What an area of a link counts, at places on it; elsewhere as at the nearest of them.

    Raises:
        GeometryError: no place, a value that is not finite, a negative weight, or nothing but zeros.
    """

    points: Floats  #: places on the link, in the frame of its mesh [m], shape (n, 3)
    weights: Floats  #: what an area counts there, not negative and not all 0, shape (n,)
    name: str = "weights"  #: of the map, for reports

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, (None, 3), f"{self.name}: places"))
        weights = frozen(self.weights, (len(self.points),), f"{self.name}: weights")
        if len(weights) == 0 or float(weights.max()) <= 0.0:
            raise GeometryError(f"{self.name}: at least one place must have a weight above 0")
        if float(weights.min()) < 0.0:
            raise GeometryError(f"{self.name}: a weight must not be negative, got {float(weights.min()):g}")
        object.__setattr__(self, "weights", weights)

    def at(self, points: Floats) -> Floats:
        """Return the weights of points [m], shape (n, 3), as shares of the largest one, shape (n,)."""
        from scipy.spatial import cKDTree

        nearest = cKDTree(self.points).query(points)[1]
        return np.asarray(np.maximum(self.weights[nearest] / self.weights.max(), LEAST_WEIGHT))

    def check_place(self, hull: Floats) -> None:
        """Refuse a map of another place, or in another unit, than a link with these points [m], shape (n, 3).

        Raises:
            GeometryError: all places are farther away than the link reaches, or within a hundredth of that.
        """
        from scipy.spatial import cKDTree

        away = float(cKDTree(self.points).query(hull)[0].min())
        extent, ours = float(np.ptp(hull, axis=0).max()), float(np.ptp(self.points, axis=0).max())
        if away > extent or 0.0 < ours < 0.01 * extent:
            raise GeometryError(
                f"{self.name}: the places are {1e3 * away:.4g} mm from a link of {1e3 * extent:.4g} mm, and reach over "
                f"{1e3 * ours:.3g} mm: they must be in mm, in the frame of the mesh"
            )


def read_touch_weights(path: str | Path) -> TouchWeights:
    """Read a map of weights: a CSV file with the columns x_mm, y_mm, z_mm and weight, one line for each place.

    The places are in the frame of the mesh; an area counts as the nearest place does, so a few places are enough.

    Args:
        path: the file, in UTF-8. Columns of other names are ignored.

    Raises:
        GeometryError: the file cannot be read, a column is missing, or a value is no number or out of range.
    """
    path = Path(path)
    text = read_text(path, _MAX_SIZE, "the text of a map of weights", lambda why: GeometryError(f"{path}: {why}"))
    rows = csv.DictReader(io.StringIO(text))
    head = [name.strip() for name in rows.fieldnames or ()]
    missing = [name for name in _MAP_COLUMNS if name not in head]
    if missing:
        raise GeometryError(
            f"{path}: a map of weights has the columns {', '.join(_MAP_COLUMNS)} in its first line; "
            f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        )
    rows.fieldnames = head
    values: list[list[float]] = []
    for row in rows:
        try:
            values.append([float(row[name]) for name in _MAP_COLUMNS])
        except (TypeError, ValueError) as exc:
            raise GeometryError(
                f"{path}: line {rows.line_num} must have a number in each of {', '.join(_MAP_COLUMNS)}"
            ) from exc
        *place, weight = values[-1]
        if not (all(abs(x) <= _MAX_COORDINATE for x in place) and 0.0 <= weight < math.inf):
            raise GeometryError(
                f"{path}: line {rows.line_num}: places must be finite and within {_MAX_COORDINATE:g} mm, "
                f"and weights finite and not negative, got {values[-1]}"
            )
    table = np.array(values, float).reshape(-1, 4)
    return TouchWeights(table[:, :3] * 1e-3, table[:, 3], path.name)


def exposure_weights(hull: SurfaceSamples, rays: RayCaster) -> TouchWeights:
    """Return the exposure of a link, as ``free_shares`` of its hull; where other links stand, name a map."""
    return TouchWeights(hull.points, free_shares(hull.points, hull.normals, rays), "exposure")


def free_shares(points: Floats, normals: Floats, rays: RayCaster) -> Floats:
    """Return the share of the half-space above each place from which it can be reached, shape (n,).

    Rays leave each place in directions spread evenly over the hemisphere about its normal, weighted by their cosine;
    those that meet the mesh count nothing. A convex body has the share 1 everywhere; the corner between two housings
    has less.

    Args:
        points: places on a mesh [m], shape (n, 3).
        normals: unit outward normals there, shape (n, 3).
    """
    turn = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(_RAY_COUNT)  # the golden angle spreads them evenly
    out = np.sqrt((np.arange(_RAY_COUNT) + 0.5) / _RAY_COUNT)  # evenly over the disc: by the cosine over the hemisphere
    spread = np.stack([out * np.cos(turn), out * np.sin(turn), np.sqrt(1.0 - out**2)], axis=1)
    frames = np.array([np.stack([*perpendicular_vectors(normal), normal], axis=1) for normal in normals])
    ways = np.einsum("nij,rj->nri", frames, spread).reshape(-1, 3)
    starts = np.repeat(points + _FINGER_LIFT * normals, _RAY_COUNT, axis=0)
    return np.asarray(np.isinf(rays.cast(starts, ways)[0]).reshape(-1, _RAY_COUNT).mean(axis=1))
