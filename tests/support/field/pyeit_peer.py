"""pyEIT on the two-sheet problem: its linear triangles for the sheets, its linear tetrahedra for the gap between them.

pyEIT has point electrodes only, one conductivity for each element and no mesh that couples two sheets. What its users
can do, and what is done here: an electrode is one node that stands for all nodes of its edge; the contact is a layer of
tetrahedra so thin that it carries nothing sideways; currents are driven between electrodes and the potentials give the
impedances. The element matrices and the assembly are pyEIT's own (loops in Python); the factors are SciPy's, once for
all drives (pyEIT's own `solve` would factorise for every drive).
"""

from __future__ import annotations

import math
import time

import numpy as np

from .port_solution import PeerSolution
from .problems import Problem
from .skfem_peer import FlatMesh, make_mesh

NAME = "pyEIT"
LIMITS = "degree 1 with straight edges only; no complete electrode model: electrodes by merging nodes; Python loops"


def solve(problem: Problem, size: float = 0.1, inside: float = 0.2, mesh: FlatMesh | None = None) -> PeerSolution:
    """Solve the impedances between the electrodes, then the energies of the three modes."""
    from pyeit.eit.fem import assemble, calculate_ke
    from scipy.sparse.linalg import splu

    if any(math.isinf(d.conductance) for d in problem.discs):
        raise NotImplementedError("a perfect bond needs the discs' nodes merged by hand")
    seconds: dict[str, float] = {}
    start = time.process_time()
    flat = make_mesh(problem, size, inside) if mesh is None else mesh
    seconds["mesh"] = time.process_time() - start

    start = time.process_time()
    count = flat.nodes.shape[1]
    # Node numbers: the upper sheet, then the lower one, with each electrode's nodes merged into the first of them.
    merged = np.arange(2 * count)
    electrode = {}
    for name, shift in (("A", 0), ("B", 0), ("C", count), ("D", count)):
        nodes = np.unique(flat.edges[name]) + shift
        merged[nodes] = nodes[0]
        electrode[name] = nodes[0]
    used, merged = np.unique(merged, return_inverse=True)
    electrode = {name: int(np.searchsorted(used, node)) for name, node in electrode.items()}
    triangles = flat.triangles.T
    sheet_nodes = flat.nodes.T
    local = calculate_ke(sheet_nodes, triangles)
    unknowns = len(used)
    stiffness = assemble(
        np.concatenate([local, local]),
        merged[np.concatenate([triangles, triangles + count])],
        np.repeat([1 / problem.upper, 1 / problem.lower], len(triangles)),
        unknowns,
        ref=-1,
    )
    # A prism under each triangle of a disc, cut into three tetrahedra. A layer of thickness t and conductivity g t
    # carries g across and g t^2 along: t is a millionth of the disc's radius.
    for number, disc in enumerate(problem.discs):
        cells = np.sort(triangles[flat.disc == number + 1], axis=1)
        thickness = 1e-6 * disc.radius
        a, b, c = cells.T
        tetrahedra = np.concatenate(
            [
                np.stack([a, b, c, c + count], axis=1),
                np.stack([a, b, b + count, c + count], axis=1),
                np.stack([a, a + count, b + count, c + count], axis=1),
            ]
        )
        layers = np.concatenate([np.c_[sheet_nodes, np.full(count, thickness)], np.c_[sheet_nodes, np.zeros(count)]])
        edges = layers[tetrahedra[:, 1:]] - layers[tetrahedra[:, :1]]
        flipped = np.linalg.det(edges) > 0  # pyEIT counts the other way round
        tetrahedra[flipped] = tetrahedra[flipped][:, [1, 0, 2, 3]]
        gap = calculate_ke(layers, tetrahedra)
        stiffness = stiffness + assemble(
            gap, merged[tetrahedra], np.full(len(tetrahedra), disc.conductance * thickness), unknowns, ref=-1
        )
    seconds["assemble"] = time.process_time() - start

    start = time.process_time()
    keep = np.delete(np.arange(unknowns), electrode["A"])
    factors = splu(stiffness[keep][:, keep].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    seconds["factorise"] = time.process_time() - start

    start = time.process_time()
    rows = [int(np.searchsorted(keep, electrode[name])) for name in ("B", "C", "D")]
    drive = np.zeros((len(keep), 3))
    drive[rows, range(3)] = 1.0
    impedance = factors.solve(drive)[rows]
    modes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    energies = modes @ np.linalg.inv(impedance) @ modes.T
    seconds["solve"] = time.process_time() - start
    return PeerSolution(energies, seconds, len(keep))
