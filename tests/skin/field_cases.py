"""Sensors and one slow, independent solver that the field tests share."""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from coneskin.skin.field.fourport import angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet

PAPER = SectorSheet.of_sector(0.1, 0.1, math.pi / 2)  # r1 = 100, r2 = 200 mm, 90 degrees: inferred from its figures
SHEETS = {
    "paper": PAPER,
    "narrowing": SectorSheet(0.1, -6.0, 0.3, 2.5),
    "cylinder": SectorSheet(0.1, 0.0, 0.07, 2.5),
    "long strip": SectorSheet(0.5, 0.2, 0.03, 1.0),
    "full turn": SectorSheet.of_sector(0.03, 0.1, 2 * math.pi),
}


def guide_volts(model: FieldModel, coupling) -> np.ndarray:
    """All eight electrode potentials of the radial and the angular phase at 1 V, shape (n, 8)."""
    return np.concatenate(
        [model.read(coupling, phase).electrodes for phase in (radial_phase(), angular_phase())], axis=1
    )


def finite_differences(model: FieldModel, u, phi, radius, conductance, cells=110) -> np.ndarray:
    """The same eight potentials from a five-point scheme on the rectangle: nothing of the multipole solver is in it."""
    sheet = model.sheet
    nx = ny = cells
    hx, hy = sheet.length / nx, sheet.breadth / ny
    # Conductance of each cell between the sheets: covered flat area times g, by 8 x 8 samples.
    fine = 8
    x = (np.arange(nx * fine) + 0.5) * hx / fine
    y = (np.arange(ny * fine) + 0.5) * hy / fine
    us, phis = sheet.locate(x[:, None], y[None, :])
    z = sheet.flat(us, phis, (u, phi))
    dense = np.where(np.abs(z) < radius, conductance * sheet.stretch(us) ** 2, 0.0)
    g = dense.reshape(nx, fine, ny, fine).mean(axis=(1, 3)).ravel() * hx * hy

    def laplacian(resistance, ends_on_x):
        def line(n, h, across, ends):
            main = np.full(n, 2.0)
            main[[0, -1]] = 3.0 if ends else 1.0  # half a cell to an electrode, nothing to an insulating edge
            matrix = sparse.diags([-np.ones(n - 1), main, -np.ones(n - 1)], [-1, 0, 1]) * (across / h)
            return matrix / resistance

        along = sparse.kron(line(nx, hx, hy, ends_on_x), sparse.eye(ny))
        return along + sparse.kron(sparse.eye(nx), line(ny, hy, hx, not ends_on_x))

    n = nx * ny
    upper, lower = laplacian(model.upper_resistance, True), laplacian(model.lower_resistance, False)
    shape = np.zeros((nx, ny))
    to = {e: shape.copy() for e in "ABCD"}
    to["A"][-1], to["B"][0] = 2 * hy / hx / model.upper_resistance, 2 * hy / hx / model.upper_resistance
    to["C"][:, -1], to["D"][:, 0] = 2 * hx / hy / model.lower_resistance, 2 * hx / hy / model.lower_resistance
    links = {e: v.ravel() for e, v in to.items()}
    link = sparse.diags(g)
    body = sparse.bmat([[upper + link, -link], [-link, lower + link]])
    zero = np.zeros(n)
    columns = [np.concatenate([links[e], zero] if e in "AB" else [zero, links[e]]) for e in "ABCD"]
    out = []
    for driven, guides in ((("A", "B"), ("C", "D")), (("D", "C"), ("B", "A"))):
        # Guides are unknown potentials with no net current.
        rows = ["ABCD".index(e) for e in guides]
        b = sparse.csr_matrix(np.stack([columns[r] for r in rows], axis=1))
        d = sparse.diags([columns[r].sum() for r in rows])
        matrix = sparse.bmat([[body, -b], [-b.T, d]]).tocsc()
        right = np.concatenate([columns["ABCD".index(driven[1])], [0.0, 0.0]])
        solved = spsolve(matrix, right)[-2:]
        volts = dict(zip(guides, solved, strict=True)) | {driven[0]: 0.0, driven[1]: 1.0}
        out += [volts[e] for e in "ABCD"]
    return np.array(out)
