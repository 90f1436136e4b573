"""Outlines of straight lines and true circular arcs.

An arc is stored as in DXF: by its chord and its bulge, tan(sweep / 4), positive where it turns left. A straight line
is the arc of bulge 0, so that the rim of a slender cone (a radius of kilometres) needs no distant centre and becomes
the edge of a rectangle continuously. Everything is computed from chord and sweep for the same reason.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import GeometryError

FlatPoint = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PathSegment:
    """A line or an arc from start to end [m]; the bulge is tan(sweep / 4)."""

    start: FlatPoint
    end: FlatPoint
    bulge: float = 0.0

    @property
    def sweep(self) -> float:
        """Angle of the arc [rad], positive to the left, 0 for a line."""
        return 4.0 * math.atan(self.bulge)

    @property
    def chord(self) -> float:
        """Straight distance from start to end [m]."""
        return math.dist(self.start, self.end)

    @property
    def length(self) -> float:
        """Length along the segment [m]."""
        half = 0.5 * self.sweep
        return self.chord * (half / math.sin(half) if half else 1.0)

    @property
    def curvature(self) -> float:
        """1 / radius [1/m], positive where the arc turns left."""
        return 2.0 * math.sin(0.5 * self.sweep) / self.chord

    @property
    def radius(self) -> float:
        """Radius of the arc [m]; infinite for a line."""
        return abs(1.0 / self.curvature) if self.bulge else math.inf

    @property
    def centre(self) -> FlatPoint:
        """Centre of the arc [m]; infinite for a line."""
        if not self.bulge:
            return math.inf, math.inf
        (x0, y0), (x1, y1), b = self.start, self.end, self.bulge
        lift = 0.25 * (1.0 / b - b)  # distance from chord to centre, in chords, to the left
        return 0.5 * (x0 + x1) - lift * (y1 - y0), 0.5 * (y0 + y1) + lift * (x1 - x0)

    def heading(self, fraction: float) -> float:
        """Return the direction of travel at a fraction of the length [rad]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0]) + (fraction - 0.5) * self.sweep

    def at(self, fraction: float) -> FlatPoint:
        """Return the point at a fraction of the length [m]."""
        sweep = self.sweep
        # below 1e-9 both sines are their arguments, which for denormal sweeps would round away
        ratio = math.sin(0.5 * fraction * sweep) / math.sin(0.5 * sweep) if abs(sweep) > 1e-9 else fraction
        reach, angle = ratio * self.chord, 0.5 * (self.heading(0.0) + self.heading(fraction))
        return self.start[0] + reach * math.cos(angle), self.start[1] + reach * math.sin(angle)

    def along(self, count: int) -> Floats:
        """Return count + 1 points at equal distances, both ends included, shape (count + 1, 2) [m]."""
        sweep, fractions = self.sweep, np.linspace(0.0, 1.0, count + 1)
        ratios = np.sin(0.5 * sweep * fractions) / math.sin(0.5 * sweep) if abs(sweep) > 1e-9 else fractions
        angles = self.heading(0.0) + 0.5 * sweep * fractions
        headings = np.column_stack((np.cos(angles), np.sin(angles)))
        return np.asarray(self.start + (self.chord * ratios)[:, None] * headings)

    def split(self, count: int) -> Iterator[PathSegment]:
        """Split the segment into equal pieces; the first and last point are kept to the last bit."""
        points = [self.start, *(self.at(i / count) for i in range(1, count)), self.end]
        bulge = math.tan(0.25 * self.sweep / count)
        for start, end in itertools.pairwise(points):
            yield PathSegment(start, end, bulge)

    @property
    def controls(self) -> tuple[FlatPoint, FlatPoint]:
        """Inner control points of a cubic over an arc of at most a quarter turn [m], from its chord."""
        half = 0.5 * abs(self.sweep)  # pull = 4/3 tan(sweep/4) radius, regular for a flat arc
        pull = 2.0 / 3.0 * self.chord * math.tan(0.5 * half) / math.sin(half) if half else self.chord / 3.0
        (x0, y0), (x1, y1), a, b = self.start, self.end, self.heading(0.0), self.heading(1.0)
        return (x0 + pull * math.cos(a), y0 + pull * math.sin(a)), (x1 - pull * math.cos(b), y1 - pull * math.sin(b))

    @property
    def area(self) -> float:
        """Area between the arc and its chord [m2], positive where the arc bulges to the right of the chord."""
        sweep = self.sweep
        if abs(sweep) < 1e-3:  # (t - sin t) / (8 sin^2(t/2)) without its cancellation; the next term is t^4 / 1e3
            return self.chord**2 * sweep / 12.0 * (1.0 + sweep * sweep / 30.0)
        return self.chord**2 * (sweep - math.sin(sweep)) / (8.0 * math.sin(0.5 * sweep) ** 2)


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed outline, or an open path if ``closed`` is False.

    Attributes:
        vertices: x [m], y [m] and the bulge of the segment that leaves the vertex.
        closed: True if the last vertex joins the first.

    Raises:
        GeometryError: too few vertices, a value that is not finite, or a segment without length.
    """

    vertices: tuple[tuple[float, float, float], ...]
    closed: bool = True

    def __post_init__(self) -> None:
        if len(self.vertices) < 2:
            raise GeometryError(f"an outline needs at least 2 vertices, got {len(self.vertices)}")
        if not all(math.isfinite(value) for vertex in self.vertices for value in vertex):
            raise GeometryError(f"an outline must be finite, got {self.vertices}")
        for segment in self.segments():
            if segment.chord == 0.0:
                raise GeometryError(f"an outline must not repeat a vertex, got {segment.start} m twice")

    @classmethod
    def from_segments(cls, segments: list[PathSegment], closed: bool = True) -> Outline:
        """Make an outline of consecutive segments."""
        vertices = [(*s.start, s.bulge) for s in segments]
        if not closed:
            vertices.append((*segments[-1].end, 0.0))
        return cls(tuple(vertices), closed)

    def segments(self) -> Iterator[PathSegment]:
        """Yield the lines and arcs in order."""
        following = self.vertices[1:] + (self.vertices[:1] if self.closed else ())
        for (x, y, bulge), (x1, y1, _) in zip(self.vertices, following, strict=False):
            yield PathSegment((x, y), (x1, y1), bulge)

    @property
    def area(self) -> float:
        """Enclosed area [m2], positive where the outline runs counter-clockwise."""
        x0, y0, _ = self.vertices[0]  # relative to a vertex: a distant origin would cost digits
        return math.fsum(
            0.5 * ((s.start[0] - x0) * (s.end[1] - y0) - (s.end[0] - x0) * (s.start[1] - y0)) + s.area
            for s in self.segments()
        )

    @property
    def length(self) -> float:
        """Length of the cut [m]."""
        return math.fsum(segment.length for segment in self.segments())

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y [m]."""
        points = [(x, y) for x, y, _ in self.vertices]
        for segment in self.segments():
            first, sweep = segment.heading(0.0), segment.sweep
            for quarter in range(-8, 9):  # an arc is widest where it runs along an axis
                turned = quarter * 0.5 * math.pi - first
                if sweep and 0.0 < turned / sweep < 1.0:
                    points.append(segment.at(turned / sweep))
        xs, ys = [x for x, _ in points], [y for _, y in points]
        return min(xs), min(ys), max(xs), max(ys)

    def moved(self, dx: float, dy: float) -> Outline:
        """Return the outline, shifted by dx and dy [m]."""
        return Outline(tuple((x + dx, y + dy, bulge) for x, y, bulge in self.vertices), self.closed)

    def rotated(self, angle: float) -> Outline:
        """Return the outline, turned anticlockwise about the origin by an angle [rad]."""
        c, s = math.cos(angle), math.sin(angle)
        return Outline(tuple((c * x - s * y, s * x + c * y, bulge) for x, y, bulge in self.vertices), self.closed)

    def mirrored(self) -> Outline:
        """Return the outline seen from behind (x changes sign); its direction of travel is kept."""
        flipped = [PathSegment((-s.end[0], s.end[1]), (-s.start[0], s.start[1]), s.bulge) for s in self.segments()]
        return Outline.from_segments(flipped[::-1], self.closed)

    def flattened(self, tolerance: float) -> Outline:
        """Return the outline in straight lines that stay within a tolerance of the arcs [m].

        Raises:
            GeometryError: the tolerance is not above 0.
        """
        if not tolerance > 0.0:
            raise GeometryError(f"flattening tolerance must be above 0 m, got {tolerance!r} m")
        chords: list[PathSegment] = []
        for segment in self.segments():  # sag of one of n pieces: length * sweep / (8 n^2)
            count = max(1, math.ceil(math.sqrt(segment.length * abs(segment.sweep) / (8.0 * tolerance))))
            chords.extend(PathSegment(piece.start, piece.end) for piece in segment.split(count))
        return Outline.from_segments(chords, self.closed)

    def offset(self, distance: float) -> Outline:
        """Return the closed outline grown by a distance [m], shrunk if it is negative; corners stay sharp.

        Raises:
            GeometryError: the outline is open, or a detail is smaller than the offset.
        """
        if not self.closed:
            raise GeometryError("only a closed outline can be offset")
        if distance == 0.0:
            return self
        left = -math.copysign(distance, distance * self.area)  # inside is on the left when counter-clockwise
        segments = list(self.segments())
        corners = [_corner(a, b, left) for a, b in zip(segments[-1:] + segments[:-1], segments, strict=True)]
        grown = []
        for old, start, end in zip(segments, corners, corners[1:] + corners[:1], strict=True):
            (ax, ay), (bx, by) = old.start, old.end
            along = (end[0] - start[0]) * (bx - ax) + (end[1] - start[1]) * (by - ay)
            stretch = 1.0 - old.curvature * left
            half_sine = 0.5 * old.curvature / stretch * math.dist(start, end) if stretch > 0.0 else math.inf
            if along <= 0.0 or abs(half_sine) > 1.0:
                raise GeometryError(
                    f"an offset of {distance * 1e3:.4g} mm is larger than a detail of {old.length * 1e3:.4g} mm: "
                    "reduce the kerf"
                )
            grown.append(PathSegment(start, end, math.tan(0.5 * math.asin(half_sine))))
        return Outline.from_segments(grown)


def joint_bounds(boxes: Iterable[tuple[float, float, float, float]]) -> tuple[float, float, float, float]:
    """Return the box around boxes: smallest x, smallest y, largest x, largest y [m]."""
    x0, y0, x1, y1 = zip(*boxes, strict=True)
    return min(x0), min(y0), max(x1), max(y1)


def circle_outline(x: float, y: float, radius: float) -> Outline:
    """Return a circle in four quarters, counter-clockwise; centre and radius [m]."""
    quarter = math.tan(math.pi / 8.0)
    ring = ((radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius))
    return Outline(tuple((x + dx, y + dy, quarter) for dx, dy in ring))


def _corner(before: PathSegment, after: PathSegment, left: float) -> FlatPoint:
    """Return the intersection of two neighbouring segments that are both moved to the left by a distance [m].

    With X measured from the common vertex, the points at the distance t to the left of an arc through it with left
    normal n and curvature k satisfy n.X - k |X|^2 / 2 = t - k t^2 / 2, regular for lines: Newton's method solves both.
    """
    x0, y0 = after.start
    curves = []
    for heading, k in ((before.heading(1.0), before.curvature), (after.heading(0.0), after.curvature)):
        curves.append((-math.sin(heading), math.cos(heading), k, left - 0.5 * k * left * left))
    (ax, ay, ka, ga), (bx, by, kb, gb) = curves
    cross, x, y = ax * by - ay * bx, 0.0, 0.0
    if abs(cross) < 1e-6:
        if ax * bx + ay * by < 0.0:
            raise GeometryError("an outline that turns back on itself cannot be offset")
        return x0 + left * ax, y0 + left * ay
    for _ in range(20):
        fa = ax * x + ay * y - 0.5 * ka * (x * x + y * y) - ga
        fb = bx * x + by * y - 0.5 * kb * (x * x + y * y) - gb
        axx, axy, bxx, bxy = ax - ka * x, ay - ka * y, bx - kb * x, by - kb * y
        det = axx * bxy - axy * bxx
        if det == 0.0:
            break
        dx, dy = (fa * bxy - fb * axy) / det, (fb * axx - fa * bxx) / det
        x, y = x - dx, y - dy
        if math.hypot(dx, dy) <= 1e-15 * abs(left):
            return x0 + x, y0 + y
    if math.hypot(dx, dy) <= 1e-9 * abs(left):
        return x0 + x, y0 + y
    raise GeometryError(f"an offset of {abs(left) * 1e3:.4g} mm is too large for a corner of the outline")
