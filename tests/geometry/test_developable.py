"""Laws of a developable side: it keeps lengths, its rulings share a normal, and a round one is the frustum."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from tests.support.flat_pattern import locate_flat

TURN = 2.0 * math.pi
POSE = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, -0.5, 0.6))
FRUSTA = {
    "cylinder": Frustum(0.05, 0.05, 0.2),
    "widening": Frustum(0.05, 0.07, 0.2, 4.0),
    "narrowing": Frustum(0.06, 0.05, 0.2, 3.0),
    "steep": Frustum(0.03, 0.1, 0.05, 5.0),
}
RNG = np.random.default_rng(7)
SHARES = RNG.random(7) / 7.0 + 0.02


def bent(frustum: Frustum, even: bool = False) -> Developable:
    """A side of seven bends, of which one is a plane; or of bends as even as a cone's."""
    widths = SHARES / SHARES.sum() * frustum.wrap
    turns = (
        widths * frustum.cos_half_angle if even else np.array([0.0, 0.9, 0.2, 0.7, 0.1, 0.8, 0.3]) * frustum.wrap / 3.0
    )
    return Developable(
        frustum, bends=tuple(Bend(float(width), float(turn)) for width, turn in zip(widths, turns, strict=True))
    )


def stadium(flat: float = 0.04, radius: float = 0.03) -> Developable:
    """Half of a flat, a half circle, a flat, a half circle, half of a flat: closed."""
    around = 2.0 * (flat + math.pi * radius)
    pieces = [
        (0.5 * flat, 0.0),
        (math.pi * radius, math.pi),
        (flat, 0.0),
        (math.pi * radius, math.pi),
        (0.5 * flat, 0.0),
    ]
    bends = tuple(Bend(TURN * arc / around, turn) for arc, turn in pieces)
    return Developable(Frustum(around / TURN, around / TURN, 0.2), bends=bends)


def places(side: Developable, count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return rng.random(count) * side.frustum.slant, rng.random(count) * side.frustum.wrap


each_frustum = pytest.mark.parametrize("frustum", FRUSTA.values(), ids=FRUSTA)


@each_frustum
def test_an_even_bend_is_the_frustum(frustum: Frustum) -> None:
    side = bent(frustum, even=True)
    u, phi = places(side)
    assert side.place(u, phi)[0] == pytest.approx(frustum.points(u, phi), abs=1e-15)
    assert side.rulings(phi)[2] == pytest.approx(frustum.normals(phi), abs=1e-14)
    assert side.growth == pytest.approx(frustum.cos_half_angle, rel=1e-14)


@each_frustum
def test_lengths_are_those_of_the_frustum(frustum: Frustum) -> None:
    """The first fundamental form, by differences: du^2 + rho^2 dphi^2."""
    side, h = bent(frustum), 1e-6
    u, phi = places(side)
    along = (side.place(u + h, phi)[0] - side.place(u - h, phi)[0]) / (2.0 * h)
    around = (side.place(u, phi + h)[0] - side.place(u, phi - h)[0]) / (2.0 * h)
    rho = np.array([frustum.radius_at(value) for value in u])
    inner = np.abs(phi[:, None] - np.cumsum([bend.width for bend in side.bends])).min(axis=1) > 2.0 * h
    assert (along**2).sum(axis=1) == pytest.approx(1.0, abs=1e-8)
    assert (along * around).sum(axis=1)[inner] == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(around, axis=1)[inner] == pytest.approx(rho[inner], abs=1e-9)


@each_frustum
def test_a_straight_line_of_the_flat_pattern_keeps_its_length_and_is_a_geodesic(frustum: Frustum) -> None:
    """Chords of the wrapped line, and the part of its curvature in the tangent plane, know nothing of the formulas."""
    side = bent(frustum)
    one, two = frustum.flat_point(0.1 * frustum.slant, 0.05), frustum.flat_point(0.8 * frustum.slant, 0.5)
    parts = np.linspace(0.0, 1.0, 20_001)
    flat = np.outer(1.0 - parts, one) + np.outer(parts, two)
    u, phi = np.array([locate_flat(frustum, x, y) for x, y in flat]).T
    line = side.place(u, phi)[0]
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(math.dist(one, two), rel=1e-8)
    before, at, after = line[100:19800:400], line[150:19850:400], line[200:19900:400]
    sideways = np.cross(side.rulings(phi[150:19850:400])[2], after - before)
    curvature = np.einsum("ij,ij->i", after - 2.0 * at + before, sideways)
    assert np.abs(curvature).max() < 1e-4 * np.linalg.norm(after - before, axis=1).max() ** 3


@each_frustum
def test_a_ruling_has_one_normal_so_the_gaussian_curvature_is_zero(frustum: Frustum) -> None:
    side, h = bent(frustum), 1e-6
    u, phi = places(side)
    along = (side.place(u + h, phi)[0] - side.place(u - h, phi)[0]) / (2.0 * h)
    around = (side.place(u, phi + h)[0] - side.place(u, phi - h)[0]) / (2.0 * h)
    normal = np.cross(around, along)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert normal == pytest.approx(side.rulings(phi)[2], abs=1e-7)


@each_frustum
def test_locate_undoes_point(frustum: Frustum) -> None:
    side = bent(frustum)
    u, phi = places(side)
    found = side.locate_all(side.place(u, phi)[0] + 0.004 * side.rulings(phi)[2])
    assert found[0] == pytest.approx(u, abs=1e-12)
    assert found[1] == pytest.approx(phi, abs=1e-11)
    assert found[2] == pytest.approx(0.004, abs=1e-12)
    assert side.locate(side.point(0.01, 1.0)) == pytest.approx((0.01, 1.0, 0.0), abs=1e-12)


def test_beyond_an_open_edge_the_strip_goes_on_but_not_over_the_side() -> None:
    """Nearly all of a stadium, cut open in a flat: what is high above the bend beside it has its foot on that bend."""
    whole = stadium().moved(POSE)
    part = whole.part(0.0, 0.2, 0.3, TURN - 0.3)
    phi = np.linspace(0.0, part.frustum.wrap, 60)
    points, normals = part.place(np.full(60, 0.1), phi)
    assert part.locate_all(points + 0.004 * normals)[1] == pytest.approx(phi, abs=1e-9)
    ahead = part.place(0.1, -0.2)[0]
    assert part.locate(tuple(ahead))[1] == pytest.approx(-0.2, abs=1e-12)


def test_numbers_and_arrays_agree() -> None:
    side = bent(FRUSTA["widening"])
    u, phi = places(side, 40)
    assert np.array([side.point(*at) for at in zip(u, phi, strict=True)]) == pytest.approx(
        side.place(u, phi)[0], abs=1e-15
    )
    assert np.array([side.normal(at) for at in phi]) == pytest.approx(side.rulings(phi)[2], abs=1e-14)


def test_a_stadium_closes_and_is_a_stadium() -> None:
    side = stadium()
    assert side._opening == pytest.approx((0.0, 0.0), abs=1e-14)
    points = side.place(0.05, np.linspace(0.0, TURN, 400))[0]
    across = points[:, 1]
    assert np.ptp(across) == pytest.approx(0.04 + 2 * 0.03, abs=1e-4)
    assert np.ptp(points[:, 0]) == pytest.approx(2 * 0.03, abs=1e-12)
    assert side.turn == pytest.approx(TURN)
    assert side.point(0.1, -0.2) == pytest.approx(side.point(0.1, TURN - 0.2), abs=1e-15)


def test_a_parallel_side_of_a_tube_is_a_tube_at_its_height() -> None:
    """Every point lies at the height above the same ruling, whose azimuth there grows by what the bends have grown."""
    placed, height = stadium().moved(POSE), 0.004
    above = placed.parallel(height)
    u, phi = places(placed)
    points, normals = placed.place(u, phi)
    raised = np.array([placed.azimuth_above(height, value) for value in phi])
    assert above.place(u, raised)[0] == pytest.approx(points + height * normals, abs=1e-14)
    assert above.frustum.radius1 == pytest.approx(placed.frustum.radius1 + height)
    assert placed.mismatch(height) == 0.0


@pytest.mark.parametrize("lift", [0.0, 0.002])
@each_frustum
def test_a_parallel_side_lies_at_its_height_whatever_the_section(frustum: Frustum, lift: float) -> None:
    placed, height = bent(frustum).moved(POSE).parallel(lift), 0.003
    above = placed.parallel(height)
    u, phi = places(placed)
    points, normals = placed.place(u, phi)
    raised = np.array([placed.azimuth_above(height, value) for value in phi])
    assert above.place(u, raised)[0] == pytest.approx(points + height * normals, abs=1e-14)
    assert above.place(u, raised)[1] == pytest.approx(normals, abs=1e-13)
    found = above.locate_all(points)
    assert found[0] == pytest.approx(u, abs=1e-12)
    assert found[1] == pytest.approx(raised, abs=1e-11)
    assert found[2] == pytest.approx(-height, abs=1e-12)
    down = above.parallel(-height - lift)
    assert down.lift == pytest.approx(0.0, abs=1e-18)
    assert down.frustum.radius1 == pytest.approx(frustum.radius1, rel=1e-14)


@each_frustum
def test_what_a_parallel_cone_misses_is_stated(frustum: Frustum) -> None:
    """Arcs are measured with chords of the true parallel side; at the ends they miss the sector's by the mismatch."""
    placed, height = bent(frustum).moved(POSE), 0.003
    phi = np.linspace(0.0, frustum.wrap * (1.0 - 1e-12), 40_001)
    raised = np.array([placed.azimuth_above(height, value) for value in phi[::200]])
    sector = placed.parallel(height).frustum
    missed = []
    for u in (0.0, 0.5 * frustum.slant, frustum.slant):
        points, normals = placed.place(np.full(phi.shape, u), phi)
        chords = np.linalg.norm(np.diff(points + height * normals, axis=0), axis=1)
        arc = np.concatenate([[0.0], np.cumsum(chords)])[::200]
        missed.append(float(np.abs(arc - sector.radius_at(u) * raised).max()))
    assert missed[1] < 1e-7
    assert missed[0] == pytest.approx(placed.mismatch(height), rel=0.02, abs=1e-7)
    assert missed[2] == pytest.approx(placed.mismatch(height), rel=0.02, abs=1e-7)
    assert (placed.mismatch(height) > 1e-5) == (frustum.radius1 != frustum.radius2)
    assert bent(frustum, even=True).mismatch(height) == pytest.approx(0.0, abs=1e-15)
    assert placed.parallel(0.001).mismatch(0.002) == pytest.approx(placed.mismatch(height), rel=1e-12)


@each_frustum
def test_a_part_of_a_lifted_side_lies_within_its_mismatch_of_it(frustum: Frustum) -> None:
    whole = bent(frustum).moved(POSE).parallel(0.003)
    part = whole.part(0.2 * frustum.slant, 0.7 * frustum.slant, 0.3, 2.5)
    side = part.frustum
    u, phi = np.linspace(0.0, side.slant, 9)[:, None], np.linspace(0.0, side.wrap, 50)[None]
    found = whole.locate_all(part.place(u, phi)[0])
    assert found[2] == pytest.approx(0.0, abs=1e-12)
    assert found[0] == pytest.approx(np.broadcast_to(0.2 * frustum.slant + u, found[0].shape), abs=1e-12)
    assert found[1].min() == pytest.approx(0.3, abs=1e-12)
    assert found[1].max() == pytest.approx(2.5, abs=1e-12)
    arcs = (found[1] - 0.3) * whole.frustum.radius_at(0.45 * frustum.slant), phi * side.radius_at(0.5 * side.slant)
    assert np.abs(arcs[0] - arcs[1]).max() < 2.0 * whole.mismatch(0.0) + 1e-12


@pytest.mark.parametrize("make", [lambda: stadium(), lambda: bent(FRUSTA["narrowing"])], ids=["tube", "cone"])
def test_a_part_lies_where_it_was(make: object) -> None:
    placed = make().moved(POSE)  # type: ignore[operator]
    part = placed.part(0.02, 0.1, 0.3, 2.5)
    u, phi = places(part)
    assert part.place(u, phi)[0] == pytest.approx(placed.place(u + 0.02, phi + 0.3)[0], abs=1e-14)
    assert part.frustum.radius1 == pytest.approx(placed.frustum.radius_at(0.02))
    moved = part.moved(POSE)
    assert moved.point(0.01, 0.2) == pytest.approx(POSE.apply(part.point(0.01, 0.2)), abs=1e-14)


@pytest.mark.parametrize("turn", [0.0, 0.7, 4.0])
def test_a_turned_tube_lies_where_it_was(turn: float) -> None:
    placed = stadium().moved(POSE)
    moved = placed.turned(turn)
    u, phi = places(placed)
    assert moved.frustum == placed.frustum
    assert moved.place(u, phi)[0] == pytest.approx(placed.place(u, phi + turn)[0], abs=1e-13)
    with pytest.raises(GeometryError, match=r"only a full wrap"):
        bent(FRUSTA["narrowing"]).moved(POSE).turned(turn)


def test_a_placed_cone_has_the_same_parts() -> None:
    placed = PlacedFrustum(FRUSTA["widening"], POSE)
    part, above = placed.part(0.02, 0.1, 0.3, 2.5), placed.parallel(0.003)
    u, phi = np.array([0.0, 0.05]), np.array([0.1, 1.1])
    points, normals = placed.place(u, phi)
    assert part.place(u, phi)[0] == pytest.approx(placed.place(u + 0.02, phi + 0.3)[0], abs=1e-15)
    assert above.place(u, phi)[0] == pytest.approx(points + 0.003 * normals, abs=1e-15)
    assert not placed.bends


def test_mistakes_are_said() -> None:
    with pytest.raises(GeometryError, match=r"radius1 must be above 0 m"):
        Developable(Frustum(0.0, 0.05, 0.1), bends=(Bend(TURN, 1.0),))
    with pytest.raises(GeometryError, match=r"add up to the wrap of 360 deg, they are 180 deg"):
        Developable(FRUSTA["cylinder"], bends=(Bend(math.pi, 1.0),))
    with pytest.raises(GeometryError, match=r"a width above 0 rad"):
        Developable(FRUSTA["cylinder"], bends=(Bend(0.0, 1.0), Bend(TURN, 1.0)))
    with pytest.raises(GeometryError, match=r"a full turn"):
        Developable(FRUSTA["cylinder"], bends=(Bend(TURN, 7.0),))
    with pytest.raises(GeometryError, match=r"too sharp for a parallel side at -40 mm"):
        stadium().parallel(-0.04)
    with pytest.raises(GeometryError, match=r"phi1 must not be below 0"):
        stadium().part(0.0, 0.1, 1.0, 0.5)
