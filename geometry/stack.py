"""The layers of a sheet, each cut for the cone on which it comes to lie.

A layer whose neutral surface (the one that bending neither stretches nor squeezes) lies at the height t above the link
is wrapped on the parallel cone: both radii grow by t cos(a), so r of its flat sector grows by t cot(a); half angle,
slant and theta0 stay. On a cylinder that is a pattern wider by wrap * t. Cut for the bare link instead, the layer
leaves a seam open by wrap * t * cos(a), the same along the whole seam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from coneskin.errors import GeometryError

from .frustum import Frustum

__all__ = ["PAPER_STACK", "Assembly", "Layer", "Stack", "parallel", "snap_to_cylinder"]

Assembly = Literal["loose", "pairs", "bonded"]
#: which layers are one body when the sheet is wrapped, so that they share a neutral surface
_BODIES = {"loose": "01234", "pairs": "00122", "bonded": "00000"}


@dataclass(frozen=True, slots=True)
class Layer:
    """One layer of the sheet.

    Attributes:
        name: what it is called on parts and files.
        material: what it is cut from.
        thickness: [m].
        neutral_factor: where its own neutral surface lies, 0 at its inner and 1 at its outer face (the K-factor).
        stiffness: Young's modulus [Pa]; only the ratios count, and only in a bonded stack.

    Raises:
        GeometryError: a value is out of range.
    """

    name: str
    material: str
    thickness: float
    neutral_factor: float = 0.5
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.thickness) and self.thickness > 0.0):
            raise GeometryError(f"thickness of {self.name} must be finite and above 0 m, got {self.thickness!r} m")
        if not 0.0 <= self.neutral_factor <= 1.0:
            raise GeometryError(f"neutral factor of {self.name} must be in [0, 1], got {self.neutral_factor!r}")
        if not (math.isfinite(self.stiffness) and self.stiffness > 0.0):
            raise GeometryError(f"stiffness of {self.name} must be finite and above 0 Pa, got {self.stiffness!r} Pa")


@dataclass(frozen=True, slots=True)
class Stack:
    """Five layers from the link outwards, in the order of the paper's section 2.4.

    Attributes:
        layers: lower substrate, lower conductive, isolation, upper conductive, upper substrate.
        assembly: what is glued together flat, before it is wrapped, and so shares one neutral surface and one length:
            "loose" nothing, each layer is wrapped by itself; "pairs" each conductive sheet with its substrate, as the
            paper does (figure 13a); "bonded" all five.

    Raises:
        GeometryError: not five layers, or an unknown assembly.
    """

    layers: tuple[Layer, Layer, Layer, Layer, Layer]
    assembly: Assembly = "loose"

    def __post_init__(self) -> None:
        if len(self.layers) != 5:
            raise GeometryError(f"a stack has five layers (paper, section 2.4), got {len(self.layers)}")
        if self.assembly not in get_args(Assembly):
            raise GeometryError(f"assembly must be one of {', '.join(get_args(Assembly))}, got {self.assembly!r}")

    @property
    def thickness(self) -> float:
        """Thickness of the whole sheet [m]."""
        return math.fsum(layer.thickness for layer in self.layers)

    def face_offset(self, index: int) -> float:
        """Height of the inner face of a layer above the link [m]; index 5 gives the outer face of the sheet."""
        return math.fsum(layer.thickness for layer in self.layers[:index])

    def offset(self, index: int) -> float:
        """Height above the link [m] of the surface for which a layer is cut.

        The neutral surface of the body that it belongs to: sum E t y / sum E t over the layers that are bonded to it,
        y being the height of the neutral surface of each alone.
        """
        bodies = _BODIES[self.assembly]
        body = [i for i in range(5) if bodies[i] == bodies[index]]
        weights = [self.layers[i].stiffness * self.layers[i].thickness for i in body]
        heights = [self.face_offset(i) + self.layers[i].neutral_factor * self.layers[i].thickness for i in body]
        return math.fsum(w * y for w, y in zip(weights, heights, strict=True)) / math.fsum(weights)

    def surface(self, link: Frustum, index: int) -> Frustum:
        """The cone for which a layer is cut.

        Args:
            link: the side of the link under the sheet.
            index: of the layer, 0 next to the link.

        Raises:
            GeometryError: the layer would need a negative radius.
        """
        return parallel(link, self.offset(index))

    def ignored_gap(self, link: Frustum, index: int) -> float:
        """How far the seam of a layer stays open [m] if it is cut for the bare link."""
        return link.wrap * self.offset(index) * link.cos_half_angle

    def strain(self, link: Frustum, index: int) -> tuple[float, float]:
        """Strain of the inner and of the outer face of a layer at the narrow end once it is wrapped (- is squeezed)."""
        length = min(link.radius1, link.radius2) + self.offset(index) * link.cos_half_angle
        if length <= 0.0:
            raise GeometryError("strain is infinite at an apex: end the sheet where the radius is above 0 m")
        faces = (self.face_offset(index), self.face_offset(index + 1))
        inner, outer = ((t - self.offset(index)) * link.cos_half_angle / length for t in faces)
        return inner, outer


def parallel(frustum: Frustum, distance: float) -> Frustum:
    """The parallel cone at a distance [m] along the outward normal: same half angle, slant and theta0.

    Its end 1 lies at z = -distance * sin(half angle) of the frustum's frame.
    """
    grow = distance * frustum.cos_half_angle
    return Frustum(frustum.radius1 + grow, frustum.radius2 + grow, frustum.height, frustum.wrap)


def snap_to_cylinder(frustum: Frustum, tolerance: float) -> Frustum:
    """A cylinder of the same slant and mean radius where no cut would move by more than the tolerance.

    A cone this slender has rims of kilometres of radius that drawing programs carry badly. Its pattern differs from
    the rectangle by the sag of the corners, rho (wrap / 2)^2 |sin a| / 2, and by the taper, wrap |d| / 2 at each end.

    Args:
        frustum: the cone.
        tolerance: of the cut [m]; 0 never snaps.

    Returns:
        the cylinder, or the frustum itself where it would move a cut by more.
    """
    sag = max(frustum.radius1, frustum.radius2) * (0.5 * frustum.wrap) ** 2 * abs(frustum.sin_half_angle) / 2.0
    taper = frustum.wrap * abs(frustum.radius2 - frustum.radius1) / 2.0
    if max(sag, taper) > tolerance or frustum.radius1 == frustum.radius2:
        return frustum
    mean = 0.5 * (frustum.radius1 + frustum.radius2)
    return Frustum(mean, mean, frustum.slant, frustum.wrap)


#: The materials of the paper's section 4.1 with thicknesses that can be bought and moduli of their order of magnitude.
PAPER_STACK = Stack(
    (
        Layer("lower substrate", "silicone foam sheet", 2.5e-3, stiffness=0.3e6),
        Layer("lower conductive", "graphite paper", 0.1e-3, stiffness=1e9),
        Layer("isolation", "polyethylene mesh", 0.8e-3, stiffness=20e6),
        Layer("upper conductive", "graphite paper", 0.1e-3, stiffness=1e9),
        Layer("upper substrate", "silicone foam sheet", 2.5e-3, stiffness=0.3e6),
    )
)
