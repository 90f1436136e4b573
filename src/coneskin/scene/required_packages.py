"""Packages that a scene needs beyond those that are always there, looked for without being imported."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from coneskin.skin.sources.kinds import is_simulated

if TYPE_CHECKING:
    from .values.scene import Scene

__all__ = ["missing_packages", "required_packages"]


def required_packages(scene: Scene) -> dict[str, str]:
    """Return what guarding the scene imports: module -> the package to install."""
    needed = {}
    if scene.source is not None:
        needed["serial"] = "pyserial"
        if is_simulated(scene.source.kind) and scene.source.settings.get("model") == "field":
            needed |= {"numpy": "numpy", "scipy": "scipy"}
    if scene.arm is not None and scene.arm.control == "internal":
        needed["rtde_control"] = "ur-rtde"
    if any(link.mesh for link in scene.links):
        needed |= {"numpy": "numpy", "trimesh": "trimesh"}
    return needed


def missing_packages(scene: Scene) -> list[str]:
    """Return those that are not installed, all together."""
    return [package for module, package in required_packages(scene).items() if find_spec(module) is None]
