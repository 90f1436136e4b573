"""NGSolve on the two-sheet problem: hp finite elements in the physical plane, the discs meshed with curved elements.

Independent of coneskin's field solver by construction: no conformal map, no Green's function, no multipoles. It serves
twice, as the reference (high order, checked by a second mesh and order) and as the fastest peer.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from .port_solution import PeerSolution
from .problems import Array, CircularPatch, Problem

NAME = "NGSolve"
LIMITS = (
    "every new place of contact needs a new mesh; no sheet electrode model of its own (three Dirichlet solves here)"
)


def make_mesh(problem: Problem, size: float, inside: float, order: int) -> Any:
    """Make curved triangles of the sector with every disc resolved.

    Args:
        problem: the sensor and its contacts.
        size: longest edge away from the contacts, in units of the width r2 - r1.
        inside: longest edge in and around a disc, in units of its radius.
        order: polynomial degree of the curved edges.
    """
    if problem.patches or any(overhangs(problem, disc) for disc in problem.discs):
        return _clipped_mesh(problem, size, inside, order)
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
        for a, b in pairwise(angles):
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


def _clipped_mesh(problem: Problem, size: float, inside: float, order: int, layers: int = 3) -> Any:
    """Mesh patches, and discs that overhang the edges: solid modelling cuts them, and layers of small
    triangles surround the corners of rims and edges, because the potentials are not smooth there."""
    from netgen.occ import Axes, Glue, OCCGeometry, Pnt, Vec, WorkPlane
    from ngsolve import Mesh

    inner, outer, theta0 = problem.inner, problem.outer, problem.theta0
    if theta0 >= math.pi:
        raise NotImplementedError("clipped discs are meshed on sectors below half a turn only")
    ring = WorkPlane().Circle(0, 0, outer).Face() - WorkPlane().Circle(0, 0, inner).Face()
    far = 3 * outer
    path = WorkPlane().MoveTo(0, 0).LineTo(far, 0)
    for angle in np.linspace(0, theta0, 1 + math.ceil(theta0 / 0.8))[1:].tolist():
        path = path.LineTo(far * math.cos(angle), far * math.sin(angle))
    sector = ring * path.LineTo(0, 0).Face()
    bare, faces = sector, []
    for name, contact in problem.contacts:
        x, y = contact.r * math.cos(contact.theta), contact.r * math.sin(contact.theta)
        if isinstance(contact, CircularPatch):
            whole = WorkPlane().Circle(x, y, contact.radius).Face()
        else:
            turn = contact.theta + contact.turn
            plane = WorkPlane(Axes(Pnt(x, y, 0), n=Vec(0, 0, 1), h=Vec(math.cos(turn), math.sin(turn), 0)))
            if contact.shape == "rectangle":
                whole = plane.RectangleC(2 * contact.along, 2 * contact.across).Face()
            else:
                whole = plane.Ellipse(contact.along, contact.across).Face()
        face = whole * sector
        bare = bare - face
        face.name = name
        face.maxh = inside * contact.radius
        faces.append(face)
    bare.name = "bare"
    shape = Glue([bare, *faces])
    small = 1e-9 * outer
    meets: dict[tuple[float, float], set[str]] = {}
    for edge in shape.edges:
        start, stop = edge.parameter_interval
        middle = edge.Value((start + stop) / 2)
        r, theta = math.hypot(middle.x, middle.y), math.atan2(middle.y, middle.x)
        found = {"B": r - problem.r1, "A": r - problem.r2, "D": r * theta, "C": r * (theta - theta0)}
        edge.name = next((name for name, distance in found.items() if abs(distance) < small), "rim")
        for point in (edge.start, edge.end):
            meets.setdefault((round(point.x, 9), round(point.y, 9)), set()).add(edge.name)
    for vertex in shape.vertices:
        x, y = vertex.p.x, vertex.p.y
        touched = any(
            math.hypot(x - c.r * math.cos(c.theta), y - c.r * math.sin(c.theta)) < c.radius + small
            for _, c in problem.contacts
        )
        if touched and (problem.patches or len(meets[round(x, 9), round(y, 9)]) > 1):
            vertex.hpref = 1
    mesh = Mesh(OCCGeometry(shape, dim=2).GenerateMesh(maxh=size * (outer - inner)))
    mesh.RefineHP(layers, factor=0.15)
    mesh.Curve(order)
    return mesh


def overhangs(problem: Problem, disc: CircularPatch) -> bool:
    """Tell whether a disc reaches across an edge of the sheet."""
    straight = min(disc.r * math.sin(min(t, math.pi / 2)) for t in (disc.theta, problem.theta0 - disc.theta))
    return disc.radius > min(disc.r - problem.inner, problem.outer - disc.r, straight)


def narrow_gaps(problem: Problem) -> Iterator[tuple[float, float, float]]:
    """Return rim points (x, y) nearer than a fifth of the radius to an edge or another rim, and that distance."""
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
) -> PeerSolution:
    """Solve the three modes at polynomial degree `order`.

    The coupled system of (u, v) is condensed to the element boundaries and factorised once for the three
    right-hand sides. In a perfect bond the two sheets share their unknowns, without condensation.

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
    start = time.process_time()
    if mesh is None:
        mesh = make_mesh(problem, size, inside, order)
    seconds["mesh"] = time.process_time() - start

    start = time.process_time()
    bonded = [name for name, contact in problem.contacts if math.isinf(contact.conductance)]
    upper = ng.H1(mesh, order=order, dirichlet="A|B")
    space = upper * ng.H1(mesh, order=order, dirichlet="C|D")
    (u, v), (u_test, v_test) = space.TnT()
    form = ng.BilinearForm(space, symmetric=not bonded, condense=not bonded)
    form += (1 / problem.upper) * ng.grad(u) * ng.grad(u_test) * ng.dx
    form += (1 / problem.lower) * ng.grad(v) * ng.grad(v_test) * ng.dx
    # Current through the contacts, from the upper to the lower sheet.
    through = ng.LinearForm(space)
    for name, contact in problem.contacts:
        if name not in bonded and contact.conductance > 0:
            form += contact.conductance * (u - v) * (u_test - v_test) * ng.dx(name)
            through += contact.conductance * (u_test - v_test) * ng.dx(name)
    form.Assemble()
    through.Assemble()
    matrix, free = form.mat, space.FreeDofs(coupling=not bonded)
    if bonded:
        kept = np.flatnonzero(list(upper.GetDofs(mesh.Materials("|".join(bonded)))))
        matrix, free = _merge(ng, matrix, free, kept, kept + upper.ndof)
    seconds["assemble"] = time.process_time() - start

    start = time.process_time()
    inverse = matrix.Inverse(free, inverse="sparsecholesky")
    seconds["factorise"] = time.process_time() - start

    start = time.process_time()
    fields = []
    for values in ({"B": 1.0}, {"C": 1.0}, {"C": 1.0, "D": 1.0}):
        field = ng.GridFunction(space)
        field.components[0 if "B" in values else 1].Set(mesh.BoundaryCF(values, default=0.0), ng.BND)
        residual = (matrix * field.vec).Evaluate()
        field.vec.data -= inverse * residual
        fields.append(field)
    images = [(matrix * field.vec).Evaluate() for field in fields]
    energies = np.array([[ng.InnerProduct(field.vec, image) for image in images] for field in fields])
    for field in fields:
        if bonded:
            field.vec.FV().NumPy()[kept + upper.ndof] = field.vec.FV().NumPy()[kept]
        else:
            field.vec.data += form.harmonic_extension * field.vec
    if not bonded:
        energies[2] = energies[:, 2] = [-ng.InnerProduct(through.vec, field.vec) for field in fields]
    seconds["solve"] = time.process_time() - start

    potentials = None
    if points is not None:
        at = [mesh(r * math.cos(t), r * math.sin(t)) for r, t in points]
        potentials = np.array([[[f.components[s](p) for s in (0, 1)] for p in at] for f in fields])
    return PeerSolution(energies, seconds, int(space.ndof), potentials)


def _merge(ng: Any, matrix: Any, free: Any, kept: Any, gone: Any) -> tuple[Any, Any]:
    """Return the matrix with the unknowns `gone` identified with `kept`, and the free ones left."""
    from scipy.sparse import coo_matrix

    rows, columns, values = (np.array(part) for part in matrix.COO())
    name = np.arange(matrix.height)
    name[gone] = kept
    # The merged unknowns keep their places, empty, so that vectors need no renumbering.
    merged = coo_matrix((values, (name[rows], name[columns])), shape=(matrix.height, matrix.width)).tocsr().tocoo()
    left = ng.BitArray(free)
    for unknown in gone.tolist():
        left[unknown] = False
    made = ng.la.SparseMatrixd.CreateFromCOO(
        merged.row.tolist(), merged.col.tolist(), merged.data.tolist(), matrix.height, matrix.width
    )
    return made, left
