"""Fit of a developable side to points of a hull: its bends, its rulings and its place at once, by least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.pose import Pose

_STRIPS_PER_TURN = 64  # around a full turn; the section of a stadium of 40 mm is then within 0.03 mm
_FIT_ROUNDS = 8
_SETTLED_SHARE = 0.97  # of the error before: less is no progress
_STIFFNESS_WEIGHT = 0.02  # weight of a change of curvature between strips, against the distances of the points
_STRIP_NODES = 4  # of a strip, at which its motions are summed
_STEP_DAMPING = 1e-4  # of the steps that change nothing, such as a slide along the sheet


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """Numbers of a side: a frame T, U, N (rows) at the first ruling, arc, sine of the half angle, and turns."""

    at: Floats
    frame: Floats
    arc: float
    sine: float
    turns: Floats
    wrap: float
    slant: float

    def side(self) -> Developable:
        radius = self.arc / self.wrap
        cosine = math.sqrt(max(0.0, 1.0 - self.sine**2))
        frustum = Frustum(radius, max(radius + self.slant * self.sine, 0.0), self.slant * cosine, self.wrap)
        t, u, n = self.frame
        sa, ca = frustum.sin_half_angle, frustum.cos_half_angle
        x, z = sa * u + ca * n, ca * u - sa * n
        rows = tuple((float(x[i]), float(t[i]), float(z[i])) for i in range(3))
        origin = self.at - radius * x
        pose = Pose.trusted((rows[0], rows[1], rows[2]), (float(origin[0]), float(origin[1]), float(origin[2])))
        width = self.wrap / len(self.turns)
        return Developable(frustum, pose, tuple(Bend(width, float(turn)) for turn in self.turns))

    def moved(self, step: Floats) -> _Trial:
        """Return the trial after a step: rotation (3), shift (3), arc, sine, turns."""
        angle = float(np.linalg.norm(step[:3]))
        frame = self.frame
        if angle > 0.0:
            axis = step[:3] / angle
            cross = np.cross(np.broadcast_to(axis, (3, 3)), frame)
            frame = math.cos(angle) * frame + math.sin(angle) * cross
            frame += (1.0 - math.cos(angle)) * np.outer(self.frame @ axis, axis)
        return replace(
            self,
            at=self.at + step[3:6],
            frame=frame,
            arc=self.arc + float(step[6]),
            sine=float(np.clip(self.sine + step[7], -0.999, 0.999)),
            turns=np.maximum(self.turns + step[8:], 0.0),
        )


def fit_developable(
    section: Floats, rulings: Floats, points: Floats, full: bool, common_apex: bool, tolerance: float
) -> Developable | None:
    """Fit a developable side to points.

    Args:
        section: points in order around the side, square to the rulings; of a full turn without repeating the first,
            shape (p, 3) [m].
        rulings: unit vectors along the rulings there, from end 1 to end 2, shape (p, 3).
        points: of the hull, shape (n, 3) [m].
        full: True where the side goes all around.
        common_apex: True where the rulings meet in one point; False where they are parallel.
        tolerance: largest distance of a point that counts for sure [m].

    Returns:
        the side, with end 1 and end 2 at the outermost points; None where the section is no curve of a side.
    """
    trial = _start(section, rulings, full, common_apex, tolerance)
    if trial is None:
        return None
    u = trial.side().locate_all(points)[0]
    trial = replace(trial, slant=max(float(u.max()), 1e-3))
    best, error = trial, math.inf
    for _ in range(_FIT_ROUNDS):
        off = trial.side().locate_all(points)[2]
        now = float(np.sqrt((np.minimum(np.abs(off), 2.0 * tolerance) ** 2).mean()))
        better = now < _SETTLED_SHARE * error
        if now < error:
            best, error = trial, now
        if not better:
            break
        trial = trial.moved(_step(trial, points, full, common_apex, tolerance))
    return best.side()


def _start(section: Floats, rulings: Floats, full: bool, common_apex: bool, tolerance: float) -> _Trial | None:
    """Return a side whose bends follow a smoothed section."""
    from scipy.interpolate import splev, splprep

    points = np.concatenate([section, section[:1]]) if full else section
    keep = np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-7])
    points = points[keep]
    if len(points) < 8:
        return None
    slack = len(points) * (0.15 * tolerance) ** 2
    spline, _ = splprep(points.T, s=slack, k=3, per=full)
    fine = np.linspace(0.0, 1.0, 40 * _STRIPS_PER_TURN + 1)
    curve = np.array(splev(fine, spline)).T
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    count = _STRIPS_PER_TURN if full else max(12, round(0.6 * _STRIPS_PER_TURN))
    at = np.interp(np.linspace(0.0, arc[-1], count + 1), arc, fine)
    t = np.array(splev(at, spline, der=1)).T
    u = _ways(np.array(splev(at, spline)).T, section, rulings)
    t -= np.einsum("ij,ij->i", t, u)[:, None] * u
    t /= np.linalg.norm(t, axis=1)[:, None]
    n = np.cross(t, u)
    middle = t[1:] + t[:-1]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    turns = 2.0 * np.arcsin(np.clip(0.5 * np.einsum("ij,ij->i", np.diff(n, axis=0), middle), -0.99, 0.99))
    turns = np.maximum(turns, 0.0)
    length = float(arc[-1])
    sine_arc = 0.0  # theta0: the angle of the flat sector
    if common_apex:
        sine_arc = float(np.linalg.norm(np.diff(u, axis=0), axis=1).sum())
        if float(np.einsum("ij,ij->i", np.diff(u, axis=0), middle).sum()) < 0.0:
            sine_arc = -sine_arc
    wrap = math.tau if full else min(math.hypot(sine_arc, float(turns.sum())), math.tau - 1e-3)
    if wrap < 0.1 or abs(sine_arc) > 0.99 * wrap:
        return None
    start = np.array(splev(at[:1], spline)).T[0]
    return _Trial(start, np.stack([t[0], u[0], n[0]]), length, sine_arc / wrap, turns, wrap, 0.01)


def _ways(at: Floats, section: Floats, rulings: Floats) -> Floats:
    """Return the rulings at points near a section, from those of its nearest two points."""
    off = np.linalg.norm(at[:, None] - section[None], axis=2)
    near = np.argsort(off, axis=1)[:, :2]
    weight = 1.0 / (np.take_along_axis(off, near, axis=1) + 1e-9)
    u = (rulings[near] * weight[..., None]).sum(axis=1)
    return np.asarray(u / np.linalg.norm(u, axis=1)[:, None])


def _step(trial: _Trial, points: Floats, full: bool, common_apex: bool, tolerance: float) -> Floats:
    """Return the step of a damped Gauss-Newton iteration with Tukey's weights; no turn becomes negative."""
    side = trial.side()
    u, phi, off = side.locate_all(points)
    feet, normals = side.place(u, phi)
    scale = max(4.0 * float(np.median(np.abs(off))), tolerance)
    weights = np.where(np.abs(off) < scale, 1.0 - (off / scale) ** 2, 0.0)
    weights *= (phi > -1e-9) & (phi < trial.wrap + 1e-9)
    count = 8 + len(trial.turns)
    free = np.ones(count, bool)
    free[6] = full  # the arc of an open side is a matter of its turns
    free[7] = common_apex
    slopes = _motions(trial, side, feet, normals, phi)
    slopes[:, ~free] = 0.0
    ends, end = _ends(trial, side)
    ends[:, ~free] = 0.0
    width = trial.arc / len(trial.turns)
    reach = max(trial.arc / math.tau, 1e-3)
    units = np.concatenate([np.full(3, reach), np.ones(3), [1.0, reach], np.full(count - 8, reach)])
    stiff = _second_differences(len(trial.turns), full) * (_STIFFNESS_WEIGHT * width * math.sqrt(len(points)))
    rows = [weights[:, None] * slopes, np.diag(units * _STEP_DAMPING * math.sqrt(len(points)))]
    values = [weights * off, np.zeros(count)]
    rows.append(np.concatenate([np.zeros((len(stiff), 8)), stiff], axis=1))
    values.append(-stiff @ trial.turns)
    if full:
        heavy = 30.0 * math.sqrt(len(points))
        rows.append(heavy * ends)
        values.append(-heavy * end)
    left, right = np.concatenate(rows), np.concatenate(values)
    normal, pull = left.T @ left, left.T @ right
    pinned = np.zeros(count, bool)
    step = np.zeros(count)
    for _ in range(6):
        live = free & ~pinned
        fixed = step * pinned
        step = fixed.copy()
        step[live] = np.linalg.solve(normal[np.ix_(live, live)], (pull - normal @ fixed)[live])
        below = (trial.turns + step[8:] < -1e-12) & ~pinned[8:]
        if not below.any():
            break
        pinned[8:] |= below
        step[8:][below] = -trial.turns[below]
    return step


def _motions(trial: _Trial, side: Developable, points: Floats, ways: Floats, phi: Floats) -> Floats:
    """Return how points of a side at azimuths phi move along given ways with each number of a trial, shape (n, count).

    A ruling moves with all bends before it: more turn there is a rotation about the rulings there, more angle of the
    flat sector one about the normals there, and more arc a shift along the tangents.
    """
    count = len(trial.turns)
    nodes = trial.wrap * (np.arange(_STRIP_NODES * count) + 0.5) / (_STRIP_NODES * count)
    base, u, n = side.rulings(nodes)
    pose = side.link_frustum
    turn = np.array(pose.rotation).T
    base, u, n = pose.apply_all(base), u @ turn, n @ turn
    before = nodes[None, :] < phi[:, None]
    moments = np.cross(points, ways)
    motions = np.empty((len(points), 8 + count))
    motions[:, :3] = moments - np.cross(trial.at, ways)
    motions[:, 3:6] = ways
    motions[:, 6] = (before * (ways @ np.cross(u, n).T)).sum(axis=1) / len(nodes)

    def rotations(axes: Floats) -> Floats:
        """Return the motions by rotations about axes through the nodes, way (axis x (point - base))."""
        return np.asarray(before * (moments @ axes.T - ways @ np.cross(axes, base).T))

    # g = sine * wrap / arc, and an arc of arc / nodes belongs to each node
    motions[:, 7] = -rotations(n).sum(axis=1) * (trial.wrap / len(nodes))
    motions[:, 8:] = rotations(u).reshape(len(points), count, _STRIP_NODES).sum(axis=2) / _STRIP_NODES
    return motions


def _ends(trial: _Trial, side: Developable) -> tuple[Floats, Floats]:
    """Return how the gap between the last ruling and the first depends on each number, shape (6, count), and the gap.

    The gap is a shift [m], and a turn as a shift at the mean radius.
    """
    pose, radius = side.link_frustum, trial.arc / math.tau
    at, *rest = side.edge()
    end, (t, u, _) = np.array(pose.apply(at)), (np.array(pose.rotate(vector)) for vector in rest)
    first_u, first_n = trial.frame[1], trial.frame[2]
    gap = np.concatenate([end - trial.at, radius * np.array([t @ first_n, t @ first_u, u @ first_n])])
    points = np.stack([end, end, end, end + t, end + t, end + u, end, end, end])
    ways = np.concatenate([np.eye(3), np.stack([first_n, first_u, first_n] * 2)])
    motions = _motions(trial, side, points, ways, np.full(9, trial.wrap + 1.0))
    slopes = np.concatenate([motions[:3], radius * (motions[3:6] - motions[6:9])])
    slopes[:, :6] = 0.0  # both ends move with the whole
    return slopes, gap


def _second_differences(count: int, full: bool) -> Floats:
    one = np.eye(count)
    rows = np.roll(one, 1, axis=1) + np.roll(one, -1, axis=1) - 2.0 * one
    return rows if full else rows[1:-1]
