"""Candidate axes of a link: the axes of cones, and the axes of revolution.

Cones come from two or three points with normals, chosen by how much of the hull they explain. An axis of revolution is
the line that all normals of a surface of any profile meet. A line is given by its direction a and moment m = o x a
(Pluecker coordinates). The normal line through p along n meets it if n . m + (p x n) . a = 0, linear in (a, m): the
axis is the smallest eigenvector of a 6 x 6 form. Flat ends agree with it, so they need not be separated from the side.

The search knows no tolerance: it has gates of its own, so that the axes of a link are the same whatever is asked of the
sheets about them. A sampled link is what every search sees: its rays, samples of its hull, what areas count, and axes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.core.errors import MeshError
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .cone_fit import InfiniteCone, fit_cone
from .fit_options import MOST_TOLERANCE, FitOptions
from .profile import AxisFrame, RadialProfile, axes_apart, measure_profile
from .surface_samples import SurfaceSamples, sample_surface
from .touch_weights import TouchWeights, exposure_weights

_FIT_ROUNDS = 30  # reweighted solutions


def _find_revolution_axis(
    samples: SurfaceSamples, start: tuple[Floats, Floats] | None = None, spread: float = 0.0005
) -> tuple[Floats, Floats] | None:
    """Find the axis that most normals meet: origin [m], in the middle of the points, and unit direction.

    None where the normals have no common line (a plane, a box). The search begins near ``start``, or with equal weights
    of all normals. A normal line at the distance ``spread`` [m] has a quarter of the weight in the end; in the first
    round a hundred times that.
    """
    middle = samples.points.mean(axis=0)
    size = float(np.ptp(samples.points, axis=0).max())
    if size == 0.0:  # one point is all that is seen of it
        return None
    p, n = (samples.points - middle) / size, samples.normals
    rows = np.concatenate([np.cross(p, n), n], axis=1)
    if start is None:
        axis, moment = _smallest(rows, np.ones(len(rows)))
    else:
        axis, moment = start[1], np.cross((start[0] - middle) / size, start[1])
    for turn in range(_FIT_ROUNDS):
        lever = np.maximum(np.linalg.norm(np.cross(n, axis), axis=1), 0.05)
        miss = (rows @ np.concatenate([axis, moment])) / lever
        scale = max(spread, 100.0 * spread * 0.7**turn) / size
        axis, moment = _smallest(rows, 1.0 / (1.0 + (miss / scale) ** 2) ** 2 / lever**2)
    if not (np.isfinite(axis).all() and np.isfinite(moment).all()):
        return None
    origin = np.cross(axis, moment)
    if np.linalg.norm(origin) > 1.0:  # a line this far away is not an axis of this link
        return None
    return middle + size * origin, axis


def _smallest(rows: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the unit direction and moment of the line with the least weighted distance from the normals."""
    form = (rows * weights[:, None]).T @ rows
    aa, am, mm = form[:3, :3], form[:3, 3:], form[3:, 3:]
    solved = np.linalg.solve(mm + 1e-9 * np.trace(mm) * np.eye(3), am.T)
    axis = np.linalg.eigh(aa - am @ solved)[1][:, 0]
    moment = -solved @ axis
    return np.asarray(axis), np.asarray(moment - (moment @ axis) * axis)


_PAIR_COUNT = 2400  # pairs drawn, a cylinder from each
_TRIPLE_COUNT = 1500  # triples drawn, a cone from each
_PARTNER_POOLS = (12, 60, 1)  # points of which the nearest is the partner: near by, nearer by, anywhere
_LEAST_SHARE = 0.015  # of the hull that a hypothesis must explain: a sheet of 25 mm on a link of 300 mm has more
_VOTER_COUNT = 1200  # points that vote
_MIN_HALF_ANGLE = math.radians(8.0)  # rad; a slighter cone is found as a cylinder
_MAX_HALF_ANGLE = math.radians(75.0)  # rad; a flatter ring is a flange


def _cone_hypotheses(
    samples: SurfaceSamples, distance: float, max_count: int = 14, seed: int = 2
) -> list[InfiniteCone]:
    """Return rough cones, each of which explains a part of the hull that those before it do not.

    Two points with normals give a cylinder, three a cone. A slight cone is close enough to a cylinder as a first guess,
    while its apex, the intersection of the three tangent planes, is far away and uncertain. A point within ``distance``
    of the side [m] is explained.
    """
    rng = np.random.default_rng(seed)
    if len(samples) < 24:
        return []
    origins, axes, radii, angles = (
        np.concatenate(both) for both in zip(_cylinders(samples, rng), _cones(samples, rng), strict=True)
    )
    if len(origins) == 0:
        return []
    voters = samples.some(_VOTER_COUNT)
    explained = _explains(samples.points[voters], samples.normals[voters], origins, axes, radii, angles, distance)
    best = itertools.islice(most_voted(explained.astype(np.float32), _LEAST_SHARE), max_count)
    return [InfiniteCone(origins[k], axes[k], float(radii[k]), float(angles[k])) for k in best]


def most_voted(votes: Floats, share: float, kept: float = 0.0) -> Iterator[int]:
    """Yield the columns that most rows vote for, each counting rows less that have voted for one before.

    Args:
        votes: 1 for each row and each column for which it votes, else 0, shape (rows, columns).
        share: of the rows, below which no column is yielded.
        kept: what is left of the weight of a row that has voted for a column.
    """
    left = np.ones(len(votes), votes.dtype)
    while True:
        score = left @ votes
        best = int(score.argmax())
        if score[best] < share * len(votes):
            return
        left[votes[:, best] > 0.0] *= kept
        yield best


def _partners(samples: SurfaceSamples, rng: np.random.Generator, count: int, others: int) -> list[Ints]:
    """Draw index lists of points that belong together: of each three, one has near partners, one nearer, one any."""
    first = rng.integers(0, len(samples), count)
    chosen = [first]
    for _ in range(others):
        partner = np.empty(count, np.int64)
        for kind, size in enumerate(_PARTNER_POOLS):
            mine = np.arange(kind, count, len(_PARTNER_POOLS))
            pool = rng.integers(0, len(samples), (len(mine), size))
            gaps = np.linalg.norm(samples.points[pool] - samples.points[first[mine]][:, None], axis=2)
            partner[mine] = pool[np.arange(len(mine)), gaps.argmin(axis=1)]
        chosen.append(partner)
    return chosen


def _cylinders(samples: SurfaceSamples, rng: np.random.Generator) -> tuple[Floats, Floats, Floats, Floats]:
    i, j = _partners(samples, rng, _PAIR_COUNT, 1)
    p, q, n, m = samples.points[i], samples.points[j], samples.normals[i], samples.normals[j]
    axis = np.cross(n, m)
    sine = np.linalg.norm(axis, axis=1)
    sound = sine > math.sin(math.radians(15.0))
    p, q, n, m, axis, sine = p[sound], q[sound], n[sound], m[sound], axis[sound], sine[sound]
    axis /= sine[:, None]
    # seen along the axis, p - r n and q - s m meet
    gap, cosine = p - q, np.einsum("ij,ij->i", n, m)
    gap_n, gap_m = np.einsum("ij,ij->i", gap, n), np.einsum("ij,ij->i", gap, m)
    r = (gap_n - cosine * gap_m) / sine**2
    s = (cosine * gap_n - gap_m) / sine**2
    size = float(np.ptp(samples.points, axis=0).max())
    good = (np.minimum(r, s) > 0.003 * size) & (np.abs(r - s) < 0.15 * (r + s)) & (r + s < 1.2 * size)
    radius = 0.5 * (r + s)[good]
    foot = p[good] - radius[:, None] * n[good]
    return foot, axis[good], radius, np.zeros(len(radius))


def _cones(samples: SurfaceSamples, rng: np.random.Generator) -> tuple[Floats, Floats, Floats, Floats]:
    index = np.stack(_partners(samples, rng, _TRIPLE_COUNT, 2), axis=1)
    p, n = samples.points[index], samples.normals[index]
    sound = np.abs(np.linalg.det(n)) > 0.01
    p, n = p[sound], n[sound]
    apex = np.linalg.solve(n, np.einsum("hij,hij->hi", n, p)[..., None])[..., 0]
    rays = p - apex[:, None]
    lengths = np.linalg.norm(rays, axis=2)
    ways = rays / np.maximum(lengths, 1e-12)[..., None]
    axis = np.cross(ways[:, 1] - ways[:, 0], ways[:, 2] - ways[:, 0])
    norm = np.linalg.norm(axis, axis=1)
    axis /= np.maximum(norm, 1e-12)[:, None]
    cosine = np.einsum("ij,ij->i", axis, ways[:, 0])
    axis, cosine = axis * np.sign(cosine)[:, None], np.abs(cosine)
    angle = np.arccos(np.clip(cosine, 0.0, 1.0))
    # the outward normals of a cone that widens along its axis have the axial component -sin(angle)
    back = np.einsum("hij,hj->hi", n, axis)
    fits = (np.abs(back + np.sin(angle)[:, None]) < 0.2).all(axis=1)
    good = fits & (norm > 1e-3) & (angle > _MIN_HALF_ANGLE) & (angle < _MAX_HALF_ANGLE) & (lengths.min(axis=1) > 1e-4)
    reach = (lengths[good] * np.cos(angle[good])[:, None]).mean(axis=1)
    return apex[good] + reach[:, None] * axis[good], axis[good], reach * np.tan(angle[good]), angle[good]


def _explains(
    points: Floats, normals: Floats, origins: Floats, axes: Floats, radii: Floats, angles: Floats, distance: float
) -> Bools:
    """Return whether each point lies on each cone, shape (points, cones)."""
    middle = points.mean(axis=0)  # float32 suffices relative to the middle
    p, o = (points - middle).astype(np.float32), (origins - middle).astype(np.float32)
    n, a = normals.astype(np.float32), axes.astype(np.float32)
    ca, sa = np.cos(angles).astype(np.float32), np.sin(angles).astype(np.float32)
    z = p @ a.T - np.einsum("ij,ij->i", o, a)
    square = (p**2).sum(axis=1)[:, None] - 2.0 * (p @ o.T) + (o**2).sum(axis=1) - z**2
    rho = np.sqrt(np.maximum(square, np.float32(1e-12)))
    along = n @ a.T
    out = ((n * p).sum(axis=1)[:, None] - n @ o.T - z * along) / rho
    near = np.abs((rho - radii.astype(np.float32)) * ca - z * sa) < distance
    return np.asarray(near & (out * ca - along * sa > 0.965))


_MAX_DUPLICATE_TILT = 0.002  # rad; angle below which two axes are one
_MAX_DUPLICATE_SHIFT = 0.0002  # m; distance in the middle of the link below which two axes are one
_MAX_DUPLICATE_RADIUS = 0.001  # m; difference of radii below which two cones about one axis are one
_DISTANCE_GATES = ((0.002, 0.0005), (0.001,), (0.005,))  # m, one after another; from exact tubes to crowned ones


@dataclass(frozen=True, slots=True, eq=False)
class AxisCandidate:
    """An axis about which sheets may lie."""

    origin: Floats  #: a point of the axis [m], shape (3,)
    axis: Floats  #: unit vector; its largest component is positive, shape (3,)
    cones: tuple[InfiniteCone, ...]  #: the cones fitted about it; empty for an axis of revolution


def find_axis_candidates(samples: SurfaceSamples) -> list[AxisCandidate]:
    """Find the axes about which a profile is worth measuring, without duplicates."""
    found: list[AxisCandidate] = []
    size = float(np.ptp(samples.points, axis=0).max())

    def add(origin: Floats, axis: Floats, cone: InfiniteCone | None) -> None:
        if axis[int(np.abs(axis).argmax())] < 0.0:
            axis = -axis
            cone = cone and InfiniteCone(cone.origin, axis, cone.radius, -cone.half_angle)
        for number, other in enumerate(found):
            tilt, shift = axes_apart((origin, axis), (other.origin, other.axis))
            if tilt < _MAX_DUPLICATE_TILT and shift < _MAX_DUPLICATE_SHIFT:
                if cone is not None and not any(_same_side(cone, known) for known in other.cones):
                    found[number] = replace(other, cones=(*other.cones, cone))
                return
        found.append(AxisCandidate(origin, axis, (cone,) if cone else ()))

    thinned = samples.subset(np.arange(len(samples)) % max(1, len(samples) // 3000) == 0)
    for seed, distance in enumerate((max(0.0015, 0.004 * size), 0.001), 2):
        for start in _cone_hypotheses(samples, distance, seed=seed):
            rough = fit_cone(thinned, start, (max(0.006, 0.06 * start.radius),), 0.4, 1e-2)
            for gates in _DISTANCE_GATES if rough is not None else ():
                cone = rough
                for gate in gates:
                    cone = cone and fit_cone(thinned, cone, (gate,), precision=1e-3)
                    if cone is not None:
                        add(cone.origin, cone.axis, cone)
    centred = samples.points - samples.points.mean(axis=0)
    principal = np.linalg.eigh(centred.T @ centred)[1].T
    begins: list[tuple[Floats, Floats] | None] = [None, (samples.points.mean(axis=0), principal[2])]
    begins += [(c.origin, c.axis) for c in found[:3]]
    for begin in begins:
        line = _find_revolution_axis(samples, begin)
        if line is not None:
            add(*line, None)
    return found


def _same_side(cone: InfiniteCone, other: InfiniteCone) -> bool:
    """Tell whether two cones about one axis are one."""
    away = float((cone.origin - other.origin) @ other.axis)
    radius = other.radius + away * float(np.tan(other.half_angle))
    return abs(cone.radius - radius) < _MAX_DUPLICATE_RADIUS and abs(cone.half_angle - other.half_angle) < 0.02


_LEAST_ROUGHNESS = 0.3e-3  # m; less is details of the link
_ROUGH_TOLERANCE = 2.0  # times the roughness
_TORN_SHARE = 0.12  # of the edges; models have up to 0.06
_TORN_BRIDGE = 0.030  # m
_SEARCH_SAMPLES = 6000  # points on the mesh from which the axes are found, whatever is asked


@dataclass(frozen=True, slots=True, eq=False)
class SampledLink:
    """A link with all that every search on it needs."""

    mesh: Mesh
    rays: RayCaster
    hull: SurfaceSamples  #: samples by which sheets are looked for
    counted: SurfaceSamples  #: samples by which coverage is measured
    weights: TouchWeights | None  #: what areas count; None where all count the same
    axes: list[AxisCandidate]  #: about which sheets may lie

    @property
    def hull_area(self) -> float:
        """Area visible from outside [m2]."""
        return len(self.hull) * self.hull.area

    @property
    def weighed_area(self) -> float:
        """Area visible from outside, by the weights [m2]."""
        if self.weights is None:
            return self.hull_area
        return float(self.weights.at(self.hull.points).sum()) * self.hull.area

    @property
    def worth(self) -> Floats | None:
        """What each counted sample counts, shape (n,); None where all count the same."""
        return None if self.weights is None else self.weights.at(self.counted.points)

    def eased(self, options: FitOptions) -> tuple[FitOptions, tuple[str, ...]]:
        """Return options that allow for noise of the mesh and for faces that it lacks, with a note on each of these."""
        notes, rough, torn = [], self.hull.roughness(), self.mesh.border_share
        if rough > _LEAST_ROUGHNESS:
            tolerance = min(round(options.tolerance + _ROUGH_TOLERANCE * rough, 4), MOST_TOLERANCE)
            notes.append(
                f"the mesh is rough by {1e3 * rough:.1f} mm (root mean square): what follows its mean within "
                f"{1e3 * options.tolerance:g} mm is up to {1e3 * tolerance:.1f} mm from it, which is allowed"
            )
            options = replace(options, tolerance=tolerance)
        if torn > _TORN_SHARE and options.max_bridge < _TORN_BRIDGE:
            notes.append(
                f"faces are missing, {100.0 * torn:.0f} % of the edges border one only: holes of up to "
                f"{1e3 * _TORN_BRIDGE:g} mm are spanned"
            )
            options = replace(options, max_bridge=_TORN_BRIDGE)
        return options, tuple(notes)

    def profile(
        self, frame: AxisFrame, grid: tuple[int, int], max_bridge: float, weighed: bool = True
    ) -> RadialProfile:
        """Measure a profile about an axis, of at most so many slices and so many rays in each.

        Args:
            max_bridge: width of the widest hole that a sheet spans [m].
            weighed: by what areas count.
        """
        step = max(float(np.ptp(self.mesh.outermost @ frame.axis)) / grid[0], 0.0005)
        profile = measure_profile(self.mesh, self.rays, frame, step, grid[1], max_bridge)
        return profile.weighed(self.weights) if weighed and self.weights else profile


def sample_link(mesh: Mesh, options: FitOptions, progress: Callable[[str], None]) -> SampledLink:
    """Sample a link and find its axes; nothing is drawn by chance.

    Args:
        progress: called with the name of each step.

    Raises:
        GeometryError: the weights are not about this link.
        MeshError: no face of the mesh is visible from outside, or it is no mesh.
    """
    if not isinstance(mesh, Mesh):
        raise MeshError(
            f"the mesh must be a Mesh, got {mesh!r} of the type {type(mesh).__name__}: read a file first, as in "
            "find_cones(load_mesh('link.stl'))"
        )
    progress("sampling the hull")
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, _SEARCH_SAMPLES)
    counted = hull if options.samples == _SEARCH_SAMPLES else sample_surface(mesh, rays, options.samples)
    weights = options.weights
    if options.exposure:
        progress("casting rays to the outside")
        weights = exposure_weights(hull, rays)
    if weights is not None:
        weights.check_place(hull.points)
    progress("looking for axes")
    return SampledLink(mesh, rays, hull, counted, weights, find_axis_candidates(hull))
