"""Height of a link above the cone of a sheet, over a grid of places beside the end of the sheet.

Rays find it at the nodes. Between them an edge of the mesh may stand out further: over a facet the distance from an
axis has no maximum but on its border, so the edges are followed as well, and what stands out in a cell counts for its
four nodes. A surface through the nodes is then nowhere below the link, but for the sag of its own chords.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster

_EDGE_STEP = 0.4e-3  # m; between the points at which an edge is looked at
_GRID_MARGIN = 1e-3  # m; before the end of the sheet, and beyond the reach, that is looked at too
_LEAST_RADIUS = 4e-3  # m; a cone is not followed nearer to its apex


class _EdgePoints(NamedTuple):
    excess: Floats  # above the cone [m]
    outwards: Floats  # along the axis from the sheet's end [m]
    phi: Floats  # azimuth [rad]


class LinkExcess:
    """What is outermost beside one end of a sheet, in the frame of the sheet.

    Args:
        side: cone of the link under the sheet; it is extended beyond the end.
        step: height of the end of the sheet on the axis [m].
        sign: of the direction away from the sheet along the axis.
        reach: how far from the end is looked [m].
        body: the link, in a frame of its own; None where it is the cone itself.
        pose: of the frame of the link, seen from that of the sheet.
    """

    def __init__(self, side: Frustum, step: float, sign: float, reach: float, body: Mesh | None, pose: Pose) -> None:
        self._side, self._step, self._sign = side, step, sign
        beside = None if body is None else _beside(body, pose, step, sign, reach)
        self._far = 0.0 if beside is None else float(np.sqrt((beside.vertices[:, :2] ** 2).sum(axis=1).max())) + 0.01
        self._rays = None if beside is None else RayCaster(beside)
        self._edges = None if beside is None else self._follow_edges(beside, reach)

    def cone(self, z: float | Floats) -> Floats:
        """Return the radius of the extended cone at heights on the axis [m]."""
        slope = (self._side.radius2 - self._side.radius1) / self._side.height
        return np.asarray(np.maximum(_LEAST_RADIUS, self._side.radius1 + slope * np.asarray(z, float)))

    def height(self, outwards: float | Floats) -> Floats:
        """Return the height on the axis at a distance from the sheet's end [m]."""
        return np.asarray(self._step + self._sign * np.asarray(outwards, float))

    def over(self, share: Floats, lengths: Floats, phi: Floats, margin: float) -> Floats:
        """Return the height of the link above the cone at the nodes of a grid [m], 0 where there is no link.

        Args:
            share: of the length of a column at which its nodes lie, from 0 at the sheet's end, evenly up to 1.
            lengths: of the columns, away from the sheet [m], shape (n,).
            phi: azimuths of the columns, evenly [rad], shape (n,).
            margin: an edge outside the grid that is nearer to it than this counts too [m].
        """
        result = np.zeros((len(share), len(phi)))
        if self._rays is None or self._edges is None:
            return result
        z = self.height(share[:, None] * lengths)
        cone, radial = self.cone(z), np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=-1)
        origins = np.broadcast_to(self._far * radial, (*z.shape, 3)).copy()
        origins[..., 2] = z
        ways = np.broadcast_to(-radial, origins.shape)
        depth, _ = self._rays.cast(origins.reshape(-1, 3), np.ascontiguousarray(ways).reshape(-1, 3))
        radius = (self._far - depth).reshape(z.shape)
        # beyond the link, or through an open end of the mesh, there is nothing to lie on
        found = np.isfinite(radius) & (radius > 0.5 * cone)
        result[found] = (radius - cone)[found]
        self._add_edges(result, lengths, phi, margin)
        return result

    def _add_edges(self, result: Floats, lengths: Floats, phi: Floats, margin: float) -> None:
        """Raise the nodes around each point of an edge to its height."""
        assert self._edges is not None
        excess, outwards, azimuth = self._edges
        rows, columns = result.shape
        width = float(phi[1] - phi[0])
        beside = margin / float(self.cone(self._step))
        x = ((azimuth - phi[0] + beside) % math.tau - beside) / width
        near = (x <= columns - 1 + beside / width) & (outwards >= -margin)
        x = np.clip(x[near], 0.0, columns - 1)
        excess, outwards = excess[near], outwards[near]
        length = np.interp(x, np.arange(columns), lengths)
        reached = outwards <= length + margin
        x, excess = x[reached], excess[reached]
        y = np.clip(outwards[reached] / np.maximum(length[reached], 1e-9), 0.0, 1.0) * (rows - 1)
        for row in (np.floor(y), np.ceil(y)):
            for column in (np.floor(x), np.ceil(x)):
                np.maximum.at(result, (row.astype(int), column.astype(int)), excess)

    def _follow_edges(self, body: Mesh, reach: float) -> _EdgePoints:
        """Return points along the edges of the link that are beside the sheet's end."""
        pairs = np.sort(body.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        lower, upper = np.divmod(np.unique(pairs[:, 0] * len(body.vertices) + pairs[:, 1]), len(body.vertices))
        first, last = body.vertices[lower], body.vertices[upper]
        a, b = (self._sign * (ends[:, 2] - self._step) for ends in (first, last))
        low, high = -_GRID_MARGIN, reach + _GRID_MARGIN
        beside = (np.maximum(a, b) >= low) & (np.minimum(a, b) <= high)
        first, last, a, b = first[beside], last[beside], a[beside], b[beside]
        with np.errstate(divide="ignore", invalid="ignore"):  # the part of each edge that is beside the sheet's end
            to_low, to_high = (low - a) / (b - a), (high - a) / (b - a)
        level = a == b
        start = np.where(level, 0.0, np.clip(np.minimum(to_low, to_high), 0.0, 1.0))
        stop = np.where(level, 1.0, np.clip(np.maximum(to_low, to_high), 0.0, 1.0))
        first, last = first + start[:, None] * (last - first), first + stop[:, None] * (last - first)
        counts = np.ceil(np.linalg.norm(last - first, axis=1) / _EDGE_STEP).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(counts)), counts)
        at = (np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.maximum(counts[edge] - 1, 1)
        x, y, z = (first[edge] + at[:, None] * (last - first)[edge]).T
        return _EdgePoints(np.hypot(x, y) - self.cone(z), self._sign * (z - self._step), np.arctan2(y, x))


def _beside(body: Mesh, pose: Pose, step: float, sign: float, reach: float) -> Mesh | None:
    """Return the faces that rays or edges beside a sheet's end can meet, in its frame; None where there is none."""
    away = sign * (body.vertices @ np.array(pose.rotation[2]) + (pose.translation[2] - step))
    beyond, before = ((away > reach + _GRID_MARGIN)[body.faces], (away < -_GRID_MARGIN)[body.faces])
    near = ~(beyond.all(axis=1) | before.all(axis=1))
    return body.part(near).moved(pose) if near.any() else None
