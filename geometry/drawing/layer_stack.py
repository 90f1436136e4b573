"""Layers of a sheet, each cut for the cone on which it lies once it is wrapped.

A layer whose neutral surface (the one that bending neither stretches nor compresses) lies at the height t above the
link is wrapped on the parallel cone: both radii grow by t cos(a), so r of its flat sector grows by t cot(a); half
angle, slant and theta0 are the same. On a cylinder the pattern is wider by wrap * t. If it is cut for the bare link
instead, the layer leaves the seam open by wrap * t * cos(a), equally along the whole seam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

AssemblyMode = Literal["loose", "pairs", "bonded"]
_MAX_LAYER_THICKNESS = 0.02  # m; of a layer: what is thicker is no sheet that can be wrapped
#: number of the body to which each layer belongs when the sheet is wrapped; a body has one neutral surface
_BODY_NUMBERS = {"loose": "01234", "pairs": "00122", "bonded": "00000"}


@dataclass(frozen=True, slots=True)
class _SheetLayer:
    """One layer of the sheet.

    Attributes:
        name: on parts and in file names.
        material: on parts and in the list of materials.
        thickness: of the layer [m].
        neutral_factor: position of its own neutral surface, 0 at the inner and 1 at the outer face (the K-factor).
        stiffness: Young's modulus [Pa]; only ratios between layers that are glued together matter.

    Raises:
        GeometryError: a value is out of range.
    """

    name: str
    material: str
    thickness: float
    neutral_factor: float = 0.5
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.thickness <= _MAX_LAYER_THICKNESS:
            raise GeometryError(
                f"thickness of {self.name} must be above 0 and at most {_MAX_LAYER_THICKNESS * 1e3:g} mm, got "
                f"{self.thickness * 1e3:.4g} mm"
            )
        if not self.material.isprintable():
            raise GeometryError(f"material of {self.name} must be plain text, got {self.material!r}")
        if not 0.0 <= self.neutral_factor <= 1.0:
            raise GeometryError(f"neutral factor of {self.name} must be in [0, 1], got {self.neutral_factor!r}")
        if not (math.isfinite(self.stiffness) and self.stiffness > 0.0):
            raise GeometryError(f"stiffness of {self.name} must be finite and above 0 Pa, got {self.stiffness!r} Pa")


@dataclass(frozen=True, slots=True)
class LayerStack:
    """Five layers from the link outwards, in the order of the paper's section 2.4.

    Attributes:
        layers: lower substrate, lower conductive, isolation, upper conductive, upper substrate.
        assembly: layers that are glued together flat, before wrapping, and so share one neutral surface and one length:
            "loose" none, each layer is wrapped by itself; "pairs" each conductive sheet with its substrate, as in the
            paper (figure 13a); "bonded" all five.

    Raises:
        GeometryError: not five layers, or an unknown assembly.
    """

    layers: tuple[_SheetLayer, _SheetLayer, _SheetLayer, _SheetLayer, _SheetLayer]
    assembly: AssemblyMode = "loose"

    def __post_init__(self) -> None:
        if len(self.layers) != 5:
            raise GeometryError(f"a stack has five layers (paper, section 2.4), got {len(self.layers)}")
        if self.assembly not in get_args(AssemblyMode):
            raise GeometryError(f"assembly must be one of {', '.join(get_args(AssemblyMode))}, got {self.assembly!r}")

    @property
    def thickness(self) -> float:
        """Thickness of the whole sheet [m]."""
        return math.fsum(layer.thickness for layer in self.layers)

    def face_offset(self, index: int) -> float:
        """Return the height of the inner face of a layer above the link [m]; index 5 is the outer face of the sheet."""
        return math.fsum(layer.thickness for layer in self.layers[:index])

    def offset(self, index: int) -> float:
        """Return the height above the link of the surface for which a layer is cut [m].

        It is the neutral surface of the body of the layer: sum E t y / sum E t over the layers that are glued together,
        where y is the height of the neutral surface of each layer alone.
        """
        bodies = _BODY_NUMBERS[self.assembly]
        body = [i for i in range(5) if bodies[i] == bodies[index]]
        weights = [self.layers[i].stiffness * self.layers[i].thickness for i in body]
        heights = [self.face_offset(i) + self.layers[i].neutral_factor * self.layers[i].thickness for i in body]
        return math.fsum(w * y for w, y in zip(weights, heights, strict=True)) / math.fsum(weights)

    def middle(self, index: int) -> float:
        """Return the height of the middle of a layer above the link [m]."""
        return self.face_offset(index) + 0.5 * self.layers[index].thickness

    def surface(self, link: PlacedFrustum, index: int) -> Frustum:
        """Return the cone for which a layer is cut, or to which the side is isometric for which it is.

        Args:
            link: side of the link under the sheet.
            index: of the layer, 0 next to the link.

        Raises:
            GeometryError: the layer would need a negative radius.
        """
        return link.parallel(self.offset(index)).frustum

    def ignored_gap(self, link: PlacedFrustum, index: int) -> float:
        """Return the gap of the seam of a layer if it is cut for the bare link [m]."""
        return link.frustum.wrap * self.offset(index) * link.growth

    def strain(self, link: PlacedFrustum, index: int) -> tuple[float, float]:
        """Return the strain of the inner and the outer face of a wrapped layer at the narrow end, where it is largest.

        Tension is positive.

        Raises:
            GeometryError: the sheet reaches an apex, where the strain is infinite.
        """
        bend = link.sharpest_bend
        length = min(link.frustum.radius1, link.frustum.radius2) + self.offset(index) * bend
        if length <= 0.0:
            raise GeometryError("strain is infinite at an apex: end the sheet where the radius is above 0 mm")
        faces = (self.face_offset(index), self.face_offset(index + 1))
        inner, outer = ((t - self.offset(index)) * bend / length for t in faces)
        return inner, outer


def snap_to_cylinder(frustum: Frustum, tolerance: float) -> Frustum:
    """Replace a slender cone by a cylinder of the same slant and mean radius, if no cut moves beyond the tolerance.

    The rims of so slender a cone have radii of kilometres, which drawing programs handle badly. Its pattern differs
    from the rectangle by the sag of the corners, rho (wrap / 2)^2 |sin a| / 2, and by the taper, wrap |d| / 2 at
    each end.

    Args:
        tolerance: of the cut [m]; 0 never snaps.

    Returns:
        the cylinder, or the given frustum where a cut would move by more.
    """
    sag = max(frustum.radius1, frustum.radius2) * (0.5 * frustum.wrap) ** 2 * abs(frustum.sin_half_angle) / 2.0
    taper = frustum.wrap * abs(frustum.radius2 - frustum.radius1) / 2.0
    if max(sag, taper) > tolerance or frustum.radius1 == frustum.radius2:
        return frustum
    mean = 0.5 * (frustum.radius1 + frustum.radius2)
    return Frustum(mean, mean, frustum.slant, frustum.wrap)


#: materials of the paper's section 4.1, with common thicknesses and moduli of the right order of magnitude
PAPER_STACK = LayerStack(
    (
        _SheetLayer("lower substrate", "silicone foam sheet", 2.5e-3, stiffness=0.3e6),
        _SheetLayer("lower conductive", "graphite paper", 0.1e-3, stiffness=1e9),
        _SheetLayer("isolation", "polyethylene mesh", 0.8e-3, stiffness=20e6),
        _SheetLayer("upper conductive", "graphite paper", 0.1e-3, stiffness=1e9),
        _SheetLayer("upper substrate", "silicone foam sheet", 2.5e-3, stiffness=0.3e6),
    )
)
