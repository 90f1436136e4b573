"""Bare areas of a link, what no sheet covers, and notes on its coverage: each with the reason."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.mesh import Mesh

from .axis_plan import AxisPlan, SheetRequirements, kept_clear, plan_sheets
from .coarse_packing import AxisSurvey
from .cone_fit import InfiniteCone
from .profile import RadialProfile
from .surface_samples import SurfaceSamples

_MAX_HULL_FACES = 5000  # faces; a convex mesh with more is a smooth body, not a collision hull


def hull_note(mesh: Mesh, samples: SurfaceSamples, visual: bool = False) -> str:
    """Return a note if the mesh is a convex hull of few faces, as some collision bodies are; else an empty string.

    The positions of the samples decide, not the volume, which open and wrongly wound meshes do not have.

    Args:
        visual: True where the mesh is called the visual one, and is taken for the link.
    """
    from scipy.spatial import ConvexHull, QhullError

    if len(mesh.faces) > _MAX_HULL_FACES:
        return ""
    try:
        hull = ConvexHull(mesh.outermost)
    except QhullError:
        return ""
    points = samples.points[:: max(1, len(samples) // 1000)]
    depth = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    share = float((depth < 0.002 * mesh.size.max()).mean())
    if share < 0.95:
        return ""
    found = (
        f"{100.0 * share:.0f} % of the surface lies on the convex hull, as in simplified collision bodies, which have"
    )
    if visual:
        return f"{found} lost the tubes; it is called visual, and taken for the link: hold the test piece against that"
    asked = "use the visual mesh of the link, or allow_hull (--set search.allow_hull=true) if this is the visual mesh"
    return f"{found} lost the tubes; {asked}"


_ROUND_COSINE = 0.985
_STRAIGHT_SINE = 0.06
_LEAST_LENGTH = 0.010  # m; a cone touches a dome of 40 mm over less
_LEAST_SHARE = 0.01  # of the hull; a smaller bare area is not reported


@dataclass(frozen=True, slots=True, eq=False)
class BareArea:
    """A part of the hull without a sheet."""

    reason: str  #: why no sheet lies there, in words
    share: float  #: of the hull
    points: Floats = field(repr=False)  #: samples of it [m], shape (n, 3)


class BareTally:
    """Tally of what sheets leave bare: each reason takes what no earlier one has taken.

    Args:
        covered: those that sheets cover, shape (n,).

    Attributes:
        bare: samples that no reason has taken, shape (n,).
    """

    def __init__(self, hull: SurfaceSamples, covered: Bools) -> None:
        self.bare = ~covered
        self._hull = hull
        self._found: list[BareArea] = []

    def take(self, reason: str, chosen: Bools) -> None:
        """Take the bare ones of chosen samples, shape (n,), for a reason; a part too small to report stays bare."""
        mine = self.bare & chosen
        share = float(mine.mean())
        if share >= _LEAST_SHARE:
            self._found.append(BareArea(reason, share, self._hull.points[mine]))
            self.bare[mine] = False

    def take_more(self, count: int, covered: Bools) -> None:
        """Take what a sheet beside ``count`` others would cover, shape (n,)."""
        more = count + 1
        self.take(f"a sheet more would cover it: max_sheets = {more}, which takes {4 * more} wires", covered)

    @property
    def areas(self) -> list[BareArea]:
        """What was taken, the largest area first."""
        return sorted(self._found, key=lambda area: -area.share)


def bare_areas(
    axes: Sequence[AxisPlan],
    more: AxisPlan | None,
    surveys: list[AxisSurvey],
    hull: SurfaceSamples,
    requirements: SheetRequirements,
) -> list[BareArea]:
    """Return what a plan leaves bare, by reason, the largest area first.

    Args:
        axes: the sheets, by their axes.
        more: a sheet that could be added if one more were allowed; None where it was looked for in vain.
    """
    tally = BareTally(hull, _covered(axes, hull, requirements.tolerance))
    take = tally.take
    if more is not None:
        tally.take_more(sum(len(about.sides) for about in axes), _covered([more], hull, requirements.tolerance))
    further, hindered = _further_plans(axes, surveys, requirements)
    if further is not None and further.area < requirements.least_gain:
        little = "is too small" if requirements.weights is None else "covers too little that counts"
        take(
            f"room for a sheet that {little} to be worth its four wires",
            _covered([further], hull, requirements.tolerance),
        )
    if hindered is not None:
        take(
            "a sheet here would run into another one or reach too far around it",
            _covered([hindered], hull, requirements.tolerance),
        )
    take("flat", hull.flat())
    least = f"{requirements.min_length * 1e3:g} mm long and {math.degrees(requirements.min_wrap):g} deg wide"
    left = np.zeros(len(hull), bool)
    left[tally.bare] = _round(surveys, hull.subset(tally.bare), requirements.tolerance)
    take(f"round, but without room for a sheet {least}", left)
    take("curved in two ways, or in a corner", np.ones(len(hull), bool))
    return tally.areas


def _covered(plans: Sequence[AxisPlan], hull: SurfaceSamples, tolerance: float) -> Bools:
    """Return whether sheets cover each sample, shape (n,)."""
    covered = np.zeros(len(hull), bool)
    for about in plans:
        for side in about.sides:
            covered |= side.covers(about.profile, hull, tolerance)
    return covered


def _further_plans(
    axes: Sequence[AxisPlan], surveys: list[AxisSurvey], requirements: SheetRequirements
) -> tuple[AxisPlan | None, AxisPlan | None]:
    """Return the largest sheet that there is room for, and the largest one if the others took no room."""
    further: AxisPlan | None = None
    hindered: AxisPlan | None = None
    least = replace(requirements, least_gain=0.0)

    def larger(profile: RadialProfile, survey: AxisSurvey, known: AxisPlan | None) -> AxisPlan | None:
        found = [*([known] if known else []), *plan_sheets(profile, survey.lines, least, 1)]
        return max(found, key=lambda about: about.area, default=None)

    hopes = [
        (max((about.area for about in plan_sheets(survey.profile, survey.lines, least, 1)), default=0.0), number)
        for number, survey in enumerate(surveys)
    ]
    for hope, number in sorted(hopes, reverse=True):
        # what is there already can only take from it
        if hope <= min(about.area if about is not None else 0.0 for about in (further, hindered)):
            break
        survey = surveys[number]
        taken = replace(requirements, thickness=0.0, gap=0.0)
        further = larger(kept_clear(survey.profile, axes, requirements), survey, further)
        hindered = larger(kept_clear(survey.profile, axes, taken), survey, hindered)
    return further, hindered


def _round(surveys: list[AxisSurvey], hull: SurfaceSamples, tolerance: float) -> Bools:
    """Return whether each sample lies on a cone about one of the axes, shape (n,)."""
    on_cone = np.zeros(len(hull), bool)
    for survey in surveys:
        frame = survey.profile.frame
        for radius, slope in survey.lines:
            if radius > 0.0:
                cone = InfiniteCone(frame.origin, frame.axis, radius, math.atan(slope))
                near = np.abs(cone.distances(hull.points)) <= tolerance
                near &= cone.alignment(hull.points, hull.normals) > _ROUND_COSINE
                # along a straight side the normals keep their angle with the axis; on a dome they turn
                near &= np.abs(hull.normals @ cone.axis + math.sin(cone.half_angle)) < _STRAIGHT_SINE
                heights = (hull.points[near] - cone.origin) @ cone.axis
                if len(heights) and float(np.subtract(*np.percentile(heights, (95, 5)))) >= _LEAST_LENGTH:
                    on_cone |= near
    return on_cone
