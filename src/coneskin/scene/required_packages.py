"""Packages that a scene needs beyond those that are always there, looked for without being imported."""

from __future__ import annotations

from importlib.util import find_spec

from coneskin.core.errors import MissingExtra
from coneskin.robot.ur.ur_rtde import wheel_remedy
from coneskin.skin.sources.kinds import is_simulated

from .values.scene import Scene


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


def missing_packages(scene: Scene) -> tuple[list[str], str]:
    """Return those that are not installed, all together, and how to get them; twice nothing where all are there."""
    missing = [package for module, package in required_packages(scene).items() if find_spec(module) is None]
    remedy = f"pip install {' '.join(missing)}" if missing else ""
    if "ur-rtde" in missing and not (wheel := wheel_remedy()).startswith("pip"):
        others = [package for package in missing if package != "ur-rtde"]
        remedy = "; ".join([*([f"pip install {' '.join(others)}"] if others else []), f"ur-rtde: {wheel}"])
    return missing, remedy


def require_packages(scene: Scene) -> None:
    """Refuse a scene whose arm nothing here can move, before anything starts.

    Raises:
        MissingExtra: control is internal, and ur-rtde is not installed.
    """
    if required_packages(scene).get("rtde_control") and find_spec("rtde_control") is None:
        raise MissingExtra("ur-rtde", "moving a UR arm from your program", remedy=wheel_remedy())
