"""Layers: each is cut for the cone on which it lies."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.layer_stack import (
    PAPER_STACK,
    LayerStack,
    _SheetLayer,
    snap_to_cylinder,
)
from coneskin.geometry.frustum import Frustum, unroll
from coneskin.geometry.placed_frustum import PlacedFrustum

from ..sheet_cases import SHEETS

LINK = Frustum(0.050, 0.050, 0.200)
lengths, positive = st.floats(0.02, 0.3), st.floats(0.0, 0.4)


def stack(
    assembly="loose", factors=(0.5,) * 5, stiffness=(1.0,) * 5, thickness=(2.5e-3, 0.1e-3, 0.8e-3, 0.1e-3, 2.5e-3)
):
    rows = zip(thickness, factors, stiffness, strict=True)
    return LayerStack(tuple(_SheetLayer(f"layer {i}", "stuff", t, k, e) for i, (t, k, e) in enumerate(rows)), assembly)


def test_published_gaps_of_a_50_mm_link():
    """Table of the geometry study: 2.5 + 0.1 + 0.8 + 0.1 + 2.5 mm, all layers cut for rho = 50 mm."""
    needs = (322.01, 330.18, 333.01, 335.84, 344.00)
    gaps = (7.85, 16.02, 18.85, 21.68, 29.85)
    for i in range(5):
        cut = PAPER_STACK.surface(PlacedFrustum(LINK), i)
        assert unroll(cut).arc1 * 1e3 == pytest.approx(needs[i], abs=0.005)
        assert PAPER_STACK.ignored_gap(PlacedFrustum(LINK), i) * 1e3 == pytest.approx(gaps[i], abs=0.005)


@pytest.mark.parametrize("name", SHEETS)
def test_slant_wrap_and_theta0_stay_and_r_grows_by_t_cot_a(name):
    link = SHEETS[name]
    for i in range(5):
        layer, t = PAPER_STACK.surface(PlacedFrustum(link), i), PAPER_STACK.offset(i)
        flat, bare = unroll(layer), unroll(link)
        assert flat.slant == pytest.approx(bare.slant, rel=1e-14)
        assert layer.wrap == link.wrap
        assert flat.theta0 == pytest.approx(bare.theta0, rel=1e-9, abs=1e-15)  # d is a difference of radii
        if math.isfinite(bare.r1) and abs(link.sin_half_angle) > 1e-3:
            grow = t * link.cos_half_angle / abs(link.sin_half_angle)
            assert flat.r1 - bare.r1 == pytest.approx(grow, abs=1e-11)
            assert flat.r2 - bare.r2 == pytest.approx(grow, abs=1e-11)
        assert flat.arc1 - bare.arc1 == pytest.approx(link.wrap * t * link.cos_half_angle, abs=1e-14)


def test_the_gap_is_what_a_pattern_for_the_bare_link_lacks_all_along_the_seam():
    link = SHEETS["widening"]
    layer = PAPER_STACK.surface(PlacedFrustum(link), 4)
    for u in (0.0, 0.07, link.slant):
        lacks = link.wrap * (layer.radius_at(u) - link.radius_at(u))
        assert lacks == pytest.approx(PAPER_STACK.ignored_gap(PlacedFrustum(link), 4), rel=1e-13)


@given(lengths, lengths, positive, st.floats(0.0, 0.02), st.floats(0.0, 1.0), st.floats(0.0, 6.0))
def test_parallel_cone_is_the_normal_moved_outwards(radius1, radius2, height, t, fraction, phi):
    if radius1 == radius2:
        height += 0.01
    link = Frustum(radius1, radius2, height)
    outer, u = PlacedFrustum(link).parallel(t).frustum, fraction * link.slant
    x, y, z = outer.point(u, phi)
    want = tuple(p + t * n for p, n in zip(link.point(u, phi), link.normal(phi), strict=True))
    assert (x, y, z - t * link.sin_half_angle) == pytest.approx(want, abs=1e-15 + 4e-16)  # roundings of 0.3 m


def test_bonded_layers_share_one_length_and_are_strained():
    bonded = stack("bonded")
    assert bonded.offset(0) == pytest.approx(3.0e-3, rel=1e-14)  # by symmetry the middle of 6 mm
    assert len({bonded.surface(PlacedFrustum(LINK), i) for i in range(5)}) == 1
    inner, outer = bonded.strain(PlacedFrustum(LINK), 0)
    assert (inner + outer) / 2 == pytest.approx(-0.033, abs=5e-4)  # geometry study: -3.3 % in the inner foam
    assert bonded.strain(PlacedFrustum(LINK), 4)[1] == pytest.approx(0.057, abs=5e-4)  # and +5.7 % at the outer face
    assert stack().strain(PlacedFrustum(LINK), 0) == pytest.approx((-0.0125 / 0.5125, 0.0125 / 0.5125))


def test_neutral_surface_is_the_weighted_mean():
    """Two layers of stiffness 1 and 3: sum E t y / sum E t by hand."""
    weighted = stack("bonded", stiffness=(1.0, 1e-12, 1e-12, 1e-12, 3.0))
    assert weighted.offset(2) == pytest.approx((1.25e-3 * 1 + 4.75e-3 * 3) / 4, rel=1e-6)
    shifted = stack("bonded", factors=(0.0,) * 5, stiffness=(1.0, 1e-12, 1e-12, 1e-12, 3.0))
    assert shifted.offset(2) == pytest.approx((0.0 + 3.5e-3 * 3) / 4, rel=1e-6)


def test_pairs_follow_the_stiff_conductive_sheet():
    pairs = LayerStack(PAPER_STACK.layers, "pairs")
    assert pairs.offset(0) == pairs.offset(1) == pytest.approx(2.55e-3, abs=1e-5)  # graphite is 130 times as stiff
    assert pairs.offset(3) == pairs.offset(4) == pytest.approx(3.45e-3, abs=1e-5)
    assert pairs.offset(2) == pytest.approx(3.0e-3)


def test_neutral_factor_moves_only_its_layer():
    moved = stack(factors=(0.5, 0.5, 0.5, 0.5, 0.0))
    assert moved.offset(4) == pytest.approx(3.5e-3)
    assert [moved.offset(i) for i in range(4)] == pytest.approx([PAPER_STACK.offset(i) for i in range(4)], rel=1e-14)


@pytest.mark.parametrize("turn", [1e-8, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-5, 1e-4])
def test_snapping_moves_no_cut_by_more_than_the_tolerance(turn, tolerance):
    cone = Frustum(0.054, 0.054 + 0.434 * turn, 0.434)
    snapped = snap_to_cylinder(cone, tolerance)
    worst = max(
        math.dist(cone.flat_point(u * cone.slant, phi), snapped.flat_point(u * snapped.slant, phi))
        for u in (0.0, 0.5, 1.0)
        for phi in (-math.pi, -math.pi / 2, 0.0, math.pi / 2, math.pi)
    )
    if snapped == cone:
        assert worst == 0.0
        assert max(0.054 * math.pi**2 * turn / 2, math.pi * 0.434 * turn) > tolerance  # nor is it too shy
    else:
        assert snapped.radius1 == snapped.radius2
        assert snapped.slant == pytest.approx(cone.slant, rel=1e-15)
        assert worst <= 1.5 * tolerance  # sag and taper of the same corner, at right angles


def test_real_tubes_snap_or_keep_their_cone():
    """Half angles and lengths of the geometry study: the UR10's tube is a cylinder, the UR5e's forearm is not."""
    ur10 = Frustum(0.054, 0.054 + 1e-6, 0.434)
    ur5e = Frustum(0.0376, 0.0372, 0.261)
    assert snap_to_cylinder(ur10, 1e-5).radius1 == pytest.approx(0.0540005)
    assert snap_to_cylinder(ur5e, 1e-5) is ur5e
    assert snap_to_cylinder(ur10, 0.0) is ur10


def test_mistakes_are_said():
    with pytest.raises(GeometryError, match=r"thickness of felt must be above 0 and at most 20 mm, got 0 mm"):
        _SheetLayer("felt", "felt", 0.0)
    with pytest.raises(GeometryError, match=r"neutral factor of felt must be in \[0, 1\], got 1.5"):
        _SheetLayer("felt", "felt", 1e-3, 1.5)
    with pytest.raises(GeometryError, match="stiffness of felt must be finite and above 0 Pa, got nan Pa"):
        _SheetLayer("felt", "felt", 1e-3, stiffness=math.nan)
    with pytest.raises(GeometryError, match="a stack has five layers"):
        LayerStack(PAPER_STACK.layers[:4])
    with pytest.raises(GeometryError, match="assembly must be one of loose, pairs, bonded, got 'glued'"):
        LayerStack(PAPER_STACK.layers, "glued")
    with pytest.raises(GeometryError, match="strain is infinite at an apex"):
        stack("bonded", thickness=(1e-3,) * 5).strain(PlacedFrustum(Frustum(0.0, 0.1, 0.0)), 0)
