"""Layers above a general cone: what it costs to cut them as sectors, and what to cut them exactly would cost.

    nice -n 19 python -m bench developable-field            # half a minute

A layer at the height t above a general cone is no sector: at a distance rho from the axis an arc of the azimuth dphi,
bent by dturn, is rho dphi + t dturn long. Cut as a sector, its field is known in closed form and only its shape is off;
cut exactly, its shape is right and the field has to be computed. Both are measured, in mm on the link:

* shape: the flat sector laid over the exact flat pattern by the best rigid motion, 41 x 401 places;
* field: where the decoder, which knows the sector, puts a touch on the sheet that was cut exactly. The potentials are
  those of finite elements (bilinear, in u and phi, a node at every ruling between two bends).

The solver is checked on the sector itself, whose potentials are ln(rho) and phi: the first table.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from bench.report import head, show
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.fit.candidates import sample_link
from coneskin.geometry.fit.cones import fit_cones
from coneskin.geometry.fit.developable.packing import _with_developables
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

from .developable import MESH_KINDS, TUBE_SHAPES

Floats = NDArray[np.float64]

LAYERS = {"lower conductive": 1, "upper conductive": 3, "upper substrate": 4}
LINKS = ("oblique cone", "tapered box")
GRIDS = (1, 2, 4)


def solve(u: Floats, phi: Floats, arc: Floats, around: bool) -> Floats:
    """Return the potentials at the nodes, shape (len(u), len(phi)), of a sheet whose arc lengths per phi are given.

    Args:
        u: nodes along the rulings [m].
        phi: nodes around [rad].
        arc: length per azimuth in the middle of the elements [m], shape (len(u) - 1, len(phi) - 1).
        around: the electrodes are the edges phi, of potential 0 and 1; else the arcs, of potential 1 and 0.
    """
    du, dphi = np.diff(u)[:, None], np.diff(phi)[None]
    along, across = arc * dphi / du, du / (arc * dphi)  # conductances of an element, where the arc is even
    number = np.arange(len(u) * len(phi)).reshape(len(u), len(phi))
    corners = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]], axis=-1).reshape(-1, 4)
    one, two = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    blocks = along.reshape(-1, 1, 1) * np.kron(one, two) + across.reshape(-1, 1, 1) * np.kron(two, one)
    rows, columns = np.repeat(corners, 4, axis=1).ravel(), np.tile(corners, (1, 4)).ravel()
    matrix = sparse.csc_array((blocks.ravel(), (rows, columns)), shape=(number.size, number.size))
    low, high = (number[:, 0], number[:, -1]) if around else (number[-1], number[0])
    value = np.zeros(number.size)
    value[high] = 1.0
    free = np.setdiff1d(number, np.concatenate([low, high]))
    value[free] = splu(matrix[free][:, free].tocsc()).solve(-(matrix[free] @ value))
    return value.reshape(number.shape)


def decoded(sector: Frustum, radial: Floats, angular: Floats) -> tuple[Floats, Floats]:
    """Return u [m] and phi [rad] that the potentials stand for on a sector."""
    ratio = sector.radius2 / sector.radius1
    if abs(ratio - 1.0) < 1e-12:
        return sector.slant * (1.0 - radial), sector.wrap * angular
    return (ratio ** (1.0 - radial) - 1.0) * sector.radius1 / sector.sin_half_angle, sector.wrap * angular


def grid(place: PlacedFrustum, fine: int) -> tuple[Floats, Floats]:
    """Return nodes along and around, with so many elements in each bend."""
    ends = np.concatenate([[0.0], np.cumsum([bend.width for bend in place.bends])])
    phi = np.concatenate([np.linspace(a, b, 4 * fine, endpoint=False) for a, b in itertools.pairwise(ends)])
    return np.linspace(0.0, place.frustum.slant, 60 * fine + 1), np.append(phi, ends[-1])


def field_error(place: PlacedFrustum, height: float, fine: int, exact: bool) -> float:
    """Return how far decoded places are from the true ones at worst [m], on a layer cut exactly or as a sector."""
    below, sector = place.frustum, place.parallel(height).frustum
    u, phi = grid(place, fine)
    middle_u, middle = 0.5 * (u[1:] + u[:-1]), 0.5 * (phi[1:] + phi[:-1])
    ends = np.cumsum([bend.width for bend in place.bends])
    turns = np.array([bend.turn / bend.width for bend in place.bends])[np.searchsorted(ends, middle)]
    rho = np.array([below.radius_at(value) for value in middle_u])[:, None]
    above = phi if not exact else np.array([place.azimuth_above(height, value) for value in phi])
    arc = rho + height * turns[None] if exact else rho + height * place.growth + 0.0 * turns[None]
    found = decoded(sector, solve(u, phi, arc, around=False), solve(u, phi, arc, around=True))
    radius = np.array([sector.radius_at(value) for value in u])[:, None]
    return float(np.hypot(found[0] - u[:, None], (found[1] - above[None]) * radius).max())


def exact_pattern(place: PlacedFrustum, height: float, u: Floats, phi: Floats) -> Floats:
    """Return points of the exact flat pattern of a layer, a row of tangent arcs: shape (len(u), len(phi), 2) [m]."""
    side, points, begin, turned = place.frustum, [], 0.0, 0.0
    x = y = 0.0
    for number, bend in enumerate(place.bends):
        last = number == len(place.bends) - 1
        inside = phi[(phi >= begin) & ((phi < begin + bend.width) | last)] - begin
        radius = side.radius1 / side.sin_half_angle + height * bend.turn / (bend.width * side.sin_half_angle)
        angle = np.append(inside, bend.width) * side.sin_half_angle
        headings = turned + angle
        out = np.stack([np.sin(headings), np.cos(headings)], axis=-1)
        centre = np.array([x, y]) - radius * np.array([math.sin(turned), math.cos(turned)])
        points.append(centre + (radius + u[:, None, None]) * out[None, :-1])
        x, y = centre + radius * out[-1]
        begin, turned = begin + bend.width, turned + float(angle[-1])
    return np.concatenate(points, axis=1)


def shape_error(place: PlacedFrustum, height: float) -> tuple[float, float]:
    """Return how far the places of a flat sector are from those of the exact pattern, worst and rms [m]."""
    u, phi = np.linspace(0.0, place.frustum.slant, 41), np.linspace(0.0, place.frustum.wrap, 401)
    above = np.array([place.azimuth_above(height, value) for value in phi * (1.0 - 1e-12)])
    flat = place.parallel(height).frustum.flat_point
    sector = np.array([flat(a, b) for a in u for b in above])
    exact = exact_pattern(place, height, u, phi).reshape(-1, 2)
    one, two = sector - sector.mean(axis=0), exact - exact.mean(axis=0)
    left, _, right = np.linalg.svd(one.T @ two)
    off = np.hypot(*(one @ (left @ right) - two).T)
    return float(off.max()), math.sqrt(float((off**2).mean()))


def main() -> None:
    """Print the tables."""
    print(head("numpy", "scipy"))
    places = {}
    for name in LINKS:
        around, along, noise = MESH_KINDS["160 facets"]
        mesh = TUBE_SHAPES[name].mesh(around, along, noise)
        options = FitOptions()
        link = sample_link(mesh, options, lambda _: None)
        cones = fit_cones(link, options, lambda _: None)
        places[name] = _with_developables(link, cones, options).sheets[0].placed
    height = PAPER_STACK.offset(4)
    rows = []
    for name, place in places.items():
        for fine in GRIDS:
            off = [1e3 * field_error(place, height, fine, exact) for exact in (False, True)]
            rows.append([name, fine, f"{off[0]:.1e}", f"{off[1]:.4f}"])
    columns = ["link", "grid", "places on the sector, off at worst [mm]", "on the exact pattern [mm]"]
    show("places off, by the grid", columns, rows)
    rows = []
    for name, place in places.items():
        for layer, index in LAYERS.items():
            height = PAPER_STACK.offset(index)
            worst, rms = shape_error(place, height)
            lengths = place.mismatch(height), worst, rms, field_error(place, height, 2, True)
            rows.append([name, layer, f"{1e3 * height:.2f}", *(f"{1e3 * length:.3f}" for length in lengths)])
    columns = ["link", "layer", "height [mm]", "cut as a sector: arc at the ends off [mm]", "places off, worst [mm]"]
    show("what each way to cut costs", [*columns, "rms [mm]", "cut exactly: places off, worst [mm]"], rows)
