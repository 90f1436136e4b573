"""scikit-fem on the two-sheet problem: P1 to P4 triangles, curved to the same degree, vectorised assembly.

scikit-fem brings no mesh generator, so Netgen meshes for it. Its triangles end at degree 4; its own curved meshes end
at degree 2, so the curved edges of degree 3 and 4 are made here, through the library's isoparametric mapping.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from .port_solution import PeerSolution
from .problems import Array, Problem

NAME = "scikit-fem"
LIMITS = "no mesh generator, triangles up to degree 4, no static condensation, no sheet electrode of its own"


@dataclass(frozen=True, slots=True, eq=False)
class FlatMesh:
    """A straight-sided mesh: nodes (2, n), triangles (3, m), their disc (m,), 0 none, and edges (2, k) by name."""

    nodes: Array
    triangles: Any
    disc: Any
    edges: dict[str, Any]


def make_mesh(problem: Problem, size: float, inside: float) -> FlatMesh:
    """Return Netgen's triangles as arrays; arguments as in `ngsolve_peer`."""
    from .ngsolve_peer import make_mesh as netgen

    mesh = netgen(problem, size, inside, 1).ngmesh
    surface, line = mesh.Elements2D().NumPy(), mesh.Elements1D().NumPy()
    numbers = line["index"]
    names = [mesh.GetBCName(i) for i in range(int(numbers.max()))]
    pairs = line["nodes"][:, :2].T.astype(np.int64) - 1
    return FlatMesh(
        nodes=np.ascontiguousarray(mesh.Coordinates().T[:2]),
        triangles=np.ascontiguousarray(surface["nodes"][:, :3].T.astype(np.int64) - 1),
        disc=surface["index"] - 1,
        edges={
            name: pairs[:, np.isin(numbers, [i + 1 for i, other in enumerate(names) if other == name])]
            for name in set(names)
        },
    )


def _curved(problem: Problem, flat: FlatMesh, straight: Any, element: Any) -> Any:
    """Return the mesh with its arcs and rims bent to the element's degree, blended into the triangles beside them."""
    from skfem import MeshTri2
    from skfem.assembly import Dofs

    centres = {"A": 0j, "B": 0j} | {f"rim{i}": d.r * np.exp(1j * d.theta) for i, d in enumerate(problem.discs)}
    x, y = element.doflocs.T
    weights = np.array([1 - x - y, x, y])
    corners = straight.p[0] + 1j * straight.p[1]
    nodes = np.einsum("kn,km->nm", weights, corners[straight.t])
    bent = _facets(straight, flat, list(centres))
    for name, centre in centres.items():
        for side, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
            cells = np.flatnonzero(np.isin(straight.t2f[side], bent[name]))
            share = weights[i] + weights[j]
            along = np.divide(weights[j], share, out=np.zeros_like(share), where=share > 0)[:, None]
            a, b = corners[straight.t[i, cells]], corners[straight.t[j, cells]]
            # Equal steps of angle, so that both triangles beside an edge put its nodes in the same places.
            arc = centre + (a - centre) * np.exp(1j * along * np.angle((b - centre) / (a - centre)))
            # The power keeps the blended map as smooth as its degree needs (Lenoir).
            nodes[:, cells] += (share**element.maxdeg)[:, None] * (arc - (a + along * (b - a)))
    dofs = Dofs(straight, element).element_dofs
    places = np.zeros((2, int(dofs.max()) + 1))
    places[0, dofs], places[1, dofs] = nodes.real, nodes.imag
    return MeshTri2(places, straight.t, elem=type(element))


def _facets(mesh: Any, flat: FlatMesh, names: list[str]) -> dict[str, Any]:
    """Return the numbers of the edges with those names."""
    count = mesh.p.shape[1]
    keys = mesh.facets[0].astype(np.int64) * count + mesh.facets[1]
    order = np.argsort(keys)
    found = {}
    for name in names:
        low, high = np.sort(flat.edges[name], axis=0)
        found[name] = order[np.searchsorted(keys[order], low * count + high)]
    return found


def solve(
    problem: Problem, degree: int, size: float = 0.5, inside: float = 1.0, mesh: FlatMesh | None = None
) -> PeerSolution:
    """Solve the three modes with triangles of `degree` 1 to 4.

    One sheet's stiffness serves both; the four Dirichlet edges are condensed and SuperLU factorises once.
    """
    import skfem
    from scipy.sparse import bmat
    from scipy.sparse.linalg import splu
    from skfem.helpers import dot, grad

    if any(math.isinf(d.conductance) for d in problem.discs):
        raise NotImplementedError("a perfect bond needs the discs' unknowns merged by hand")
    element = (skfem.ElementTriP1, skfem.ElementTriP2, skfem.ElementTriP3, skfem.ElementTriP4)[degree - 1]()
    seconds: dict[str, float] = {}
    start = time.process_time()
    flat = make_mesh(problem, size, inside) if mesh is None else mesh
    seconds["mesh"] = time.process_time() - start

    start = time.process_time()
    straight = skfem.MeshTri1(flat.nodes, flat.triangles)
    domain = straight if degree == 1 else _curved(problem, flat, straight, element)
    stiffness_form = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v)))
    mass_form = skfem.BilinearForm(lambda u, v, _: u * v)
    basis = skfem.CellBasis(domain, element)
    stiffness = stiffness_form.assemble(basis)
    mass = 0.0 * stiffness
    for number, disc in enumerate(problem.discs):
        inside_disc = skfem.CellBasis(domain, element, elements=np.flatnonzero(flat.disc == number + 1))
        mass = mass + disc.conductance * mass_form.assemble(inside_disc)
    matrix = bmat([[stiffness / problem.upper + mass, -mass], [-mass, stiffness / problem.lower + mass]], format="csr")
    count = stiffness.shape[0]
    facets = _facets(straight, flat, ["A", "B", "C", "D"])
    at = {name: basis.get_dofs(facets[name]).flatten() for name in facets}
    lower = {name: at[name] + count for name in ("C", "D")}
    fixed = np.concatenate([at["A"], at["B"], lower["C"], lower["D"]])
    values = np.zeros((2 * count, 3))
    values[at["B"], 0] = 1.0
    values[lower["C"], 1] = 1.0
    values[lower["C"], 2] = values[lower["D"], 2] = 1.0
    free = np.setdiff1d(np.arange(2 * count), fixed)
    seconds["assemble"] = time.process_time() - start

    start = time.process_time()
    rows = matrix[free]
    factors = splu(rows[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    seconds["factorise"] = time.process_time() - start

    start = time.process_time()
    values[free] = factors.solve(-(rows @ values))
    energies = values.T @ (matrix @ values)
    # Row 2 as the current through the contacts: it does not cancel.
    energies[2] = -np.asarray(mass.sum(axis=0)).ravel() @ (values[:count] - values[count:])
    energies[:, 2] = energies[2]
    seconds["solve"] = time.process_time() - start
    return PeerSolution(energies, seconds, len(free))
