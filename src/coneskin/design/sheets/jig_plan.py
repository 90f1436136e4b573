"""Dimensions of the printed jig that holds a sheet at its place on the link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from coneskin.core.errors import GeometryError

__all__ = ["JigPlan", "JigSurface"]

JigSurface = Literal["link", "cone", "none"]
_SHORTEST = 4e-3  # m


@dataclass(frozen=True, slots=True)
class JigPlan:
    """Dimensions of a jig [m].

    Attributes:
        surface: what the lip lies on: "link" for the negative of the mesh (of the cone where there is no mesh), "cone"
            for the negative of the cone, "none" for no jig.
        wall: thickness of its wall.
        clearance: gap to the link and to the sheet.
        parts: into how many parts a collar around a full wrap is split; of a partial wrap no part is longer than half
            a turn.
        reach: length of the sleeve over the sheet.
        grip: length of the lip on the link.

    Raises:
        GeometryError: a dimension is out of range.
    """

    surface: JigSurface = "link"
    wall: float = 3e-3
    clearance: float = 0.3e-3
    parts: int = 2
    reach: float = 20e-3
    grip: float = 15e-3

    def __post_init__(self) -> None:
        limits = {"wall": (1.5e-3, 20e-3), "clearance": (0.0, 3e-3), "reach": (8e-3, 0.2), "grip": (_SHORTEST, 0.1)}
        for name, (least, most) in limits.items():
            value = getattr(self, name)
            if not 0.999 * least <= value <= 1.001 * most:  # millimetres in SI are not exact
                raise GeometryError(
                    f"{name} of the jig must be {least * 1e3:g} to {most * 1e3:g} mm, got {value * 1e3:.4g} mm"
                )
        if not 2 <= self.parts <= 8:
            raise GeometryError(f"a jig is split into 2 to 8 parts, got {self.parts}")
