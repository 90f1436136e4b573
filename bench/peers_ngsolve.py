"""NGSolve on the two-sheet problem: hp finite elements in the physical plane, the discs meshed with curved elements.

Independent of coneskin's field solver by construction: no conformal map, no Green's function, no multipoles. It serves
twice, as the reference (high order, checked by a second mesh and order) and as the fastest peer of bench/field.py.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from field_problems import Array, Problem

NAME = "NGSolve"
LIMITS = (
    "every new place of contact needs a new mesh; no sheet electrode model of its own (three Dirichlet solves here)"
)


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Energies of the three modes [S], seconds spent in each step, unknowns, and (u, v) at the points asked for.

    `potentials` has shape (3, points, 2): mode, point, sheet.
    """

    energies: Array
    seconds: dict[str, float]
    unknowns: int
    potentials: Array | None = None


def versions() -> dict[str, str]:
    import ngsolve

    return {"ngsolve": ngsolve.__version__}


def make_mesh(problem: Problem, size: float, inside: float, order: int) -> Any:
    """Curved triangles of the sector with every disc resolved.

    Args:
        problem: the sensor and its contacts.
        size: longest edge away from the contacts, in units of the width r2 - r1.
        inside: longest edge in and around a disc, in units of its radius.
        order: polynomial degree of the curved edges.
    """
    from netgen.geom2d import SplineGeometry
    from netgen.meshing import MeshingParameters
    from ngsolve import Mesh

    geometry = SplineGeometry()
    inner, outer, theta0 = problem.inner, problem.outer, problem.theta0
    longest = size * (outer - inner)
    towards_outer = ("B", "A") if problem.r1 < problem.r2 else ("A", "B")

    corners: dict[tuple[float, float], int] = {}

    def corner(radius: float, angle: float) -> int:
        if (radius, angle) not in corners:
            corners[radius, angle] = geometry.AddPoint(radius * math.cos(angle), radius * math.sin(angle))
        return corners[radius, angle]

    def arc(radius: float, start: float, stop: float, left: int, right: int, name: str, edge: float) -> None:
        # Netgen's rational quadratic splines are exact arcs when the control point is where the tangents meet.
        count = max(1, math.ceil(abs(stop - start) / (math.pi / 3)))
        angles = np.linspace(start, stop, count + 1).tolist()
        for a, b in zip(angles[:-1], angles[1:], strict=True):
            far = radius / math.cos((b - a) / 2)
            control = geometry.AddPoint(far * math.cos((a + b) / 2), far * math.sin((a + b) / 2))
            geometry.Append(
                ["spline3", corner(radius, a), control, corner(radius, b)],
                leftdomain=left,
                rightdomain=right,
                bc=name,
                maxh=edge,
            )

    arc(outer, 0.0, theta0, 1, 0, towards_outer[1], longest)
    arc(inner, 0.0, theta0, 0, 1, towards_outer[0], longest)
    for angle, left, right, name in ((0.0, 1, 0, "D"), (theta0, 0, 1, "C")):
        geometry.Append(
            ["line", corner(inner, angle), corner(outer, angle)],
            leftdomain=left,
            rightdomain=right,
            bc=name,
            maxh=longest,
        )
    geometry.SetMaterial(1, "bare")
    for number, disc in enumerate(problem.discs):
        centre = (disc.r * math.cos(disc.theta), disc.r * math.sin(disc.theta))
        geometry.AddCircle(
            centre, disc.radius, leftdomain=2 + number, rightdomain=1, bc=f"rim{number}", maxh=inside * disc.radius
        )
        geometry.SetMaterial(2 + number, f"disc{number}")
        geometry.SetDomainMaxH(2 + number, inside * disc.radius)
    parameters = MeshingParameters(maxh=longest)
    for x, y, gap in narrow_gaps(problem):
        parameters.RestrictH(x, y, 0.0, 2 * gap)
    mesh = Mesh(geometry.GenerateMesh(mp=parameters))
    mesh.Curve(order)
    return mesh


def narrow_gaps(problem: Problem) -> Iterator[tuple[float, float, float]]:
    """Points (x, y) of the rims nearer than a fifth of the radius to an edge or another rim, and that distance [m]."""
    angles = np.linspace(-math.pi, math.pi, 4001)
    for number, disc in enumerate(problem.discs):
        z = disc.r * np.exp(1j * disc.theta) + disc.radius * np.exp(1j * angles)
        r, theta = np.abs(z), disc.theta + np.angle(z * np.exp(-1j * disc.theta))
        gap = np.minimum(r - problem.inner, problem.outer - r)
        for angle in (theta, problem.theta0 - theta):
            gap = np.minimum(gap, r * np.sin(np.minimum(angle, math.pi / 2)))
        for other in problem.discs[:number] + problem.discs[number + 1 :]:
            gap = np.minimum(gap, np.abs(z - other.r * np.exp(1j * other.theta)) - other.radius)
        for index in np.flatnonzero(gap < 0.2 * disc.radius)[::4]:
            yield float(z[index].real), float(z[index].imag), float(gap[index])


def solve(
    problem: Problem, order: int, size: float = 0.5, inside: float = 1.0, points: Array | None = None, mesh: Any = None
) -> Solved:
    """Solve the three modes at polynomial degree `order`.

    The coupled system of (u, v) is condensed to the element boundaries and factorised once for the three
    right-hand sides. A perfect bond is a Lagrange multiplier (the current density j itself) that makes u = v.

    Args:
        problem: the sensor and its contacts.
        order: polynomial degree of the potentials and of the curved elements.
        size: see make_mesh.
        inside: see make_mesh.
        points: (r, theta) at which the potentials are wanted, shape (n, 2).
        mesh: a mesh of make_mesh, to leave its time out.
    """
    import ngsolve as ng

    seconds: dict[str, float] = {}
    start = time.perf_counter()
    if mesh is None:
        mesh = make_mesh(problem, size, inside, order)
    seconds["mesh"] = time.perf_counter() - start

    start = time.perf_counter()
    bonded = [f"disc{i}" for i, d in enumerate(problem.discs) if math.isinf(d.conductance)]
    spaces = [ng.H1(mesh, order=order, dirichlet="A|B"), ng.H1(mesh, order=order, dirichlet="C|D")]
    if bonded:
        spaces.append(ng.H1(mesh, order=order, definedon=mesh.Materials("|".join(bonded))))
    space = ng.FESpace(spaces)
    trial, test = space.TnT()
    conductance = {f"disc{i}": 0.0 if math.isinf(d.conductance) else d.conductance for i, d in enumerate(problem.discs)}
    form = ng.BilinearForm(space, symmetric=True, condense=True)
    form += (1 / problem.upper) * ng.grad(trial[0]) * ng.grad(test[0]) * ng.dx
    form += (1 / problem.lower) * ng.grad(trial[1]) * ng.grad(test[1]) * ng.dx
    jump, test_jump = trial[0] - trial[1], test[0] - test[1]
    for name, g in conductance.items():
        if g > 0:
            form += g * jump * test_jump * ng.dx(name)
    if bonded:
        # The multiplier in units of j; the jump's own penalty changes nothing where u = v but conditions the factors.
        area = ng.dx("|".join(bonded))
        penalty = (1 / problem.upper + 1 / problem.lower) / min(d.radius for d in problem.discs) ** 2
        form += penalty * (trial[2] * test_jump + test[2] * jump + jump * test_jump) * area
    form.Assemble()
    # Current through the contacts, from the upper to the lower sheet.
    through = ng.LinearForm(space)
    for name, g in conductance.items():
        if g > 0:
            through += g * test_jump * ng.dx(name)
    if bonded:
        through += penalty * test[2] * area
    through.Assemble()
    seconds["assemble"] = time.perf_counter() - start

    start = time.perf_counter()
    free = space.FreeDofs(coupling=True)
    inverse = form.mat.Inverse(free, inverse="umfpack" if bonded else "sparsecholesky")
    seconds["factorise"] = time.perf_counter() - start

    start = time.perf_counter()
    fields = []
    for upper, lower in (({"B": 1.0}, {}), ({}, {"C": 1.0}), ({}, {"C": 1.0, "D": 1.0})):
        field = ng.GridFunction(space)
        for part, values in ((0, upper), (1, lower)):
            if values:
                field.components[part].Set(mesh.BoundaryCF(values, default=0.0), ng.BND)
        # A second pass refines the indefinite factors of a perfect bond, whose pivoting loses digits.
        for _ in range(2 if bonded else 1):
            residual = (form.mat * field.vec).Evaluate()
            field.vec.data -= inverse * residual
        fields.append(field)
    energies = np.zeros((3, 3))
    for j in range(3):
        image = (form.mat * fields[j].vec).Evaluate()
        for i in range(2):
            energies[i, j] = ng.InnerProduct(fields[i].vec, image)
    for field in fields:
        field.vec.data += form.harmonic_extension * field.vec
    for j in range(3):
        energies[2, j] = energies[j, 2] = -ng.InnerProduct(through.vec, fields[j].vec)
    seconds["solve"] = time.perf_counter() - start

    potentials = None
    if points is not None:
        at = [mesh(r * math.cos(t), r * math.sin(t)) for r, t in points]
        potentials = np.array([[[f.components[s](p) for s in (0, 1)] for p in at] for f in fields])
    return Solved(energies, seconds, int(space.ndof), potentials)
