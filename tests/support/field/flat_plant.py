"""Plant of a sensor whose contacts may have any outline: finite elements in the flat sheet, as it is cut.

A disc, an ellipse, one that an edge clips, a press on both sides of the seam, several fingers: whatever a bench wants
a decoder to see. NGSolve solves it, in metres and without the conformal map, so nothing here is shared with a decoder,
nor with `coneskin.skin.field`; `tests/skin/field/test_flat_plant.py` compares the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import ngsolve_peer
from .problems import Array, EllipticPatch, Problem

_HP_LAYERS = 2  # of small triangles where an edge cuts a rim


@dataclass(frozen=True, slots=True)
class PressedPatch:
    """A contact, whole or with a part off the sheet, which then does not count.

    Attributes:
        u: slant distance of the middle from end 1 [m].
        phi: azimuth of the middle [rad].
        along: half-axis along u, before it is turned [m].
        across: half-axis along phi [m].
        ka: of its smaller half-axis, k^2 = g (Ru + Rl); inf for a perfect bond.
        turn: of the first half-axis from the direction of u towards that of phi [rad].
    """

    u: float
    phi: float
    along: float
    across: float
    ka: float
    turn: float = 0.0

    @classmethod
    def disc(cls, u: float, phi: float, radius: float, ka: float) -> PressedPatch:
        """Return a disc."""
        return cls(u, phi, radius, radius, ka)


@dataclass(frozen=True, slots=True)
class FlatPlant:
    """Two sheets on a cylinder or a cone, cut open along phi = 0.

    Attributes:
        radius1: of the circle at u = 0, the electrode B [m].
        radius2: of the circle at u = slant, the electrode A [m].
        slant: length along the side [m].
        wrap: from electrode D at phi = 0 to C [rad].
        upper: resistance of the sheet with A and B [ohm per square].
        lower: resistance of the sheet with C and D [ohm per square].
        order: polynomial degree of the elements.
        size: longest edge in parts of the shorter side.
        inside: longest edge at a contact, in parts of its smaller half-axis.
    """

    radius1: float
    radius2: float
    slant: float
    wrap: float
    upper: float
    lower: float
    order: int = 5
    size: float = 0.4
    inside: float = 1.0

    def admittance(self, patches: Sequence[PressedPatch]) -> Array:
        """Return Y of the four electrodes A, B, C, D [S], shape (4, 4)."""
        mesh = self._mesh(patches)
        energies = ngsolve_peer.solve(self._problem(patches), self.order, mesh=mesh).energies
        unit = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0], [-1.0, 0.0, 0.0, 1.0]])
        return np.asarray(unit.T @ energies @ unit)

    def conductance(self, patch: PressedPatch) -> float:
        """Return the conductance per area of a contact [S/m^2]."""
        return (patch.ka / min(patch.along, patch.across)) ** 2 / (self.upper + self.lower)

    def _problem(self, patches: Sequence[PressedPatch]) -> Problem:
        shapes = tuple(
            EllipticPatch("ellipse", 0.0, 0.0, p.along, p.across, p.turn, self.conductance(p)) for p in patches
        )
        return Problem("plant", 1.0, 2.0, 1.0, self.upper, self.lower, (), patches=shapes)

    def _mesh(self, patches: Sequence[PressedPatch]) -> Any:
        from netgen.occ import Axes, Glue, Pnt, Vec, WorkPlane

        whole, place, sides = self._flat()
        faces = []
        bare = whole
        for number, patch in enumerate(patches):
            x, y, heading = place(patch.u, patch.phi)
            heading += patch.turn
            towards = Vec(math.cos(heading), math.sin(heading), 0)
            plane = WorkPlane(Axes(Pnt(x, y, 0), n=Vec(0, 0, 1), h=towards))
            round_one = patch.along == patch.across
            face = plane.Circle(patch.along).Face() if round_one else plane.Ellipse(patch.along, patch.across).Face()
            face = face * whole
            bare = bare - face
            face.name = f"patch{number}"
            face.maxh = self.inside * min(patch.along, patch.across)
            faces.append(face)
        bare.name = "bare"
        shape = Glue([bare, *faces])
        meets: dict[tuple[float, float], set[str]] = {}
        for edge in shape.edges:
            start, stop = edge.parameter_interval
            middle = edge.Value((start + stop) / 2)
            edge.name = sides(middle.x, middle.y)
            for point in (edge.start, edge.end):
                meets.setdefault((round(point.x, 9), round(point.y, 9)), set()).add(edge.name)
        cut = False
        for vertex in shape.vertices:
            names = meets[round(vertex.p.x, 9), round(vertex.p.y, 9)]
            if "rim" in names and len(names) > 1:
                vertex.hpref = 1
                cut = True
        return self._generate(shape, cut)

    def _generate(self, shape: Any, cut: bool) -> Any:
        from netgen.occ import OCCGeometry
        from ngsolve import CF, Integrate, Mesh

        longest = self.size * min(self.slant, self.wrap * min(self.radius1, self.radius2))
        mesh = Mesh(OCCGeometry(shape, dim=2).GenerateMesh(maxh=longest, grading=0.4))
        if cut:
            mesh.RefineHP(_HP_LAYERS, factor=0.15)
        mesh.Curve(self.order)
        area, whole = Integrate(CF(1.0), mesh), 0.5 * (self.radius1 + self.radius2) * self.wrap * self.slant
        if abs(area - whole) > 1e-6 * whole:  # Netgen prints that it gave up on a face, and goes on without it
            raise RuntimeError(f"the mesh covers {area:.6g} of {whole:.6g} m^2: choose another `size` or `inside`")
        return mesh

    def _flat(self) -> tuple[Any, Any, Any]:
        """Return the flat sheet, (u, phi) -> (x, y, direction of u), and (x, y) -> name of the edge there."""
        from netgen.occ import WorkPlane

        small = 1e-9
        if self.radius1 == self.radius2:
            breadth = self.radius1 * self.wrap

            def side(x: float, y: float) -> str:
                found = {"B": x, "A": x - self.slant, "D": y, "C": y - breadth}
                return next((name for name, distance in found.items() if abs(distance) < small), "rim")

            rectangle = WorkPlane().MoveTo(0, 0).Rectangle(self.slant, breadth).Face()
            return rectangle, (lambda u, phi: (u, self.radius1 * phi, 0.0)), side
        slope = (self.radius2 - self.radius1) / self.slant
        r1, r2, share = self.radius1 / abs(slope), self.radius2 / abs(slope), abs(slope)
        inner, outer, angle = min(r1, r2), max(r1, r2), self.wrap * share
        ring = WorkPlane().Circle(0, 0, outer).Face() - WorkPlane().Circle(0, 0, inner).Face()
        far, steps = 3 * outer, 1 + math.ceil(angle / 0.8)
        path = WorkPlane().MoveTo(0, 0).LineTo(far, 0)
        for turn in np.linspace(0, angle, steps)[1:].tolist():
            path = path.LineTo(far * math.cos(turn), far * math.sin(turn))
        sector = ring * path.LineTo(0, 0).Face()
        sign = math.copysign(1.0, slope)

        def at(u: float, phi: float) -> tuple[float, float, float]:
            r, turn = r1 + sign * u, phi * share
            return r * math.cos(turn), r * math.sin(turn), turn + (0.0 if sign > 0 else math.pi)

        def bent_side(x: float, y: float) -> str:
            r, turn = math.hypot(x, y), math.atan2(y, x) % (2.0 * math.pi)
            found = {"B": r - r1, "A": r - r2, "D": r * math.sin(turn), "C": r * math.sin(turn - angle)}
            return next((name for name, distance in found.items() if abs(distance) < small), "rim")

        return sector, at, bent_side
