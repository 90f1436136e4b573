"""Plain checks of drawings by dense points: distances between outlines, points inside, overlapping boxes."""

import math

import numpy as np
from scipy.spatial import cKDTree


def dense(outline, step=0.25e-3):
    """Points along an outline, at most a step [m] apart, shape (n, 2)."""
    points = []
    for segment in outline.segments():
        count = max(2, math.ceil(segment.length / step))
        points.extend(segment.at(i / count) for i in range(count))
    if not outline.closed:
        points.append(outline.vertices[-1][:2])
    return np.array(points)


def distances(one, two):
    """Distance from every point of one set to the nearest of another [m], shape (n,)."""
    return cKDTree(two).query(one)[0]


def distance(one, two):
    """Least distance between two sets of points [m]."""
    return float(distances(one, two).min())


def inside(points, outline):
    """Whether points lie in an outline, by crossings of a ray; arcs count as lines 1 um off at most."""
    ring = np.array([vertex[:2] for vertex in outline.flattened(1e-6).vertices])
    a, b = ring, np.roll(ring, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return (crosses & (x < at)).sum(axis=1) % 2 == 1


def box(label, step=0.8e-3):
    """Points all over the box of a label [m]."""
    along = np.linspace(-0.5, 0.5, max(2, math.ceil(label.width / step))) * label.width
    across = np.linspace(-0.5, 0.5, max(2, math.ceil(label.height / step))) * label.height
    a, b = (grid.ravel() for grid in np.meshgrid(along, across))
    c, s = math.cos(label.angle), math.sin(label.angle)
    return np.stack([label.x + a * c - b * s, label.y + a * s + b * c], axis=1)
