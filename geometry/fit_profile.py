"""The outermost surface of a link about an axis: R(z, phi), by rays towards the axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit_cone import frame
from .mesh import Mesh
from .rays import Rays

__all__ = ["AxisFrame", "Profile", "bridge_holes", "outer_profile"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class AxisFrame:
    """An axis and where azimuth 0 is.

    Attributes:
        origin: a point of the axis [m], shape (3,).
        columns: unit vectors of azimuth 0, of azimuth pi / 2 and of the axis as columns, shape (3, 3).
    """

    origin: Floats
    columns: Floats

    @classmethod
    def along(cls, origin: Floats, axis: Floats, seam: Floats | None = None) -> AxisFrame:
        """Frame about an axis; azimuth 0 looks towards the direction ``seam``, made square to the axis."""
        first = frame(axis)[0]
        if seam is not None:
            square = seam - (seam @ axis) * axis
            if np.linalg.norm(square) > 1e-3:
                first = square / np.linalg.norm(square)
        return cls(origin, np.stack([first, np.cross(axis, first), axis], axis=1))

    @property
    def axis(self) -> Floats:
        """Unit vector along the axis."""
        return np.asarray(self.columns[:, 2])

    def local(self, points: Floats) -> Floats:
        """Points seen from this frame [m], shape (n, 3)."""
        return np.asarray((points - self.origin) @ self.columns)


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Radius of the hull on a grid.

    Attributes:
        frame: the axis.
        z: heights of the slices [m], ascending and evenly spaced, shape (k,).
        phi: azimuths [rad], ascending from 0, evenly spaced over the turn, shape (p,).
        radius: distance from the axis to the outermost surface [m], 0 where there is none, shape (k, p).
        bridged: the same with holes and grooves closed that a sheet spans, shape (k, p).
    """

    frame: AxisFrame
    z: Floats
    phi: Floats
    radius: Floats
    bridged: Floats

    @property
    def step(self) -> float:
        """Distance between slices [m]."""
        return float(self.z[1] - self.z[0])

    def bounds(self) -> tuple[Floats, Floats]:
        """Largest radius and smallest bridged radius of every slice [m], each of shape (k,)."""
        return self.radius.max(axis=1), self.bridged.min(axis=1)


def outer_profile(mesh: Mesh, rays: Rays, frame: AxisFrame, step: float, around: int, bridge: float = 0.010) -> Profile:
    """Measure R(z, phi) from end to end of a link.

    Args:
        mesh: the link.
        rays: a ray caster of the same mesh.
        frame: axis and azimuth 0.
        step: distance wanted between slices [m].
        around: rays in a slice.
        bridge: width and length of the widest hole that a sheet spans rather than follows [m].
    """
    local = frame.local(mesh.vertices)
    low, high = float(local[:, 2].min()), float(local[:, 2].max())
    count = max(8, round((high - low) / step))
    step = (high - low) / count
    z = low + step * (np.arange(count) + 0.5)
    phi = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)
    start = 1.02 * float(np.hypot(local[:, 0], local[:, 1]).max()) + 1e-3
    out = frame.columns[:, :2] @ np.stack([np.cos(phi), np.sin(phi)])
    origins = frame.origin + z[:, None, None] * frame.axis + start * out.T[None, :, :]
    ways = np.broadcast_to(-out.T, origins.shape)
    depth = rays.cast(origins.reshape(-1, 3), np.ascontiguousarray(ways).reshape(-1, 3))[0]
    # a ray that has passed the axis has met nothing on its own side
    radius = np.where(depth < start, start - depth, 0.0).reshape(count, around)
    present = radius[radius > 0.0]
    arc = 2.0 * math.pi / around * (float(np.median(present)) if len(present) else 1.0)
    return Profile(frame, np.asarray(z), phi, radius, bridge_holes(radius, step, arc, bridge))


def bridge_holes(height: Floats, step: float, arc: float, bridge: float, around: bool = True) -> Floats:
    """Fill what is narrower than the bridge, in length and in arc, up to its rim (a grey closing).

    Args:
        height: not negative, 0 where nothing is, shape (k, p).
        step: distance between rows [m].
        arc: distance between columns [m].
        bridge: side of the square that must fit into a hole for the hole to stay [m].
        around: whether the columns go round.
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    rows, columns = height.shape
    tall = 2 * int(bridge / step / 2.0) + 1
    wide = min(2 * int(bridge / arc / 2.0) + 1, columns - 1 + columns % 2)
    if tall == wide == 1:
        return height
    padded = np.pad(height, ((tall, tall), (0, 0)))
    padded = np.pad(padded, ((0, 0), (wide, wide)), mode="wrap" if around else "constant")
    closed = minimum_filter(maximum_filter(padded, (tall, wide)), (tall, wide))
    return np.asarray(closed[tall : tall + rows, wide : wide + columns])
