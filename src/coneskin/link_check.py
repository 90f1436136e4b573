"""Whether the links of a scene are links of its arm, and its sensors fit on them."""

from __future__ import annotations

from .scene import LinkScene, Scene

__all__ = ["check_links"]

_TUBES = {"upper_arm": 1, "forearm": 2}  # link name -> index of the DH length that is the tube's


def check_links(scene: Scene, problems: list[str]) -> None:
    """Add what is wrong to problems: a link that the arm does not have, a sensor longer than its link."""
    from .robot.link_frames import LINK_INDEX
    from .robot.ur_models import model

    if scene.arm is None:
        return
    arm = model(scene.arm.model)
    for link in scene.links:
        if link.name not in LINK_INDEX:
            problems.append(f"link {link.name}: the arm {arm.name} has no such link; it has {', '.join(LINK_INDEX)}")
        elif link.name in _TUBES:
            _check_length(link, abs(arm.a[_TUBES[link.name]]), arm.name, problems)


def _check_length(link: LinkScene, length: float, arm: str, problems: list[str]) -> None:
    for item in link.sensors:
        height = item.sensor.frustum.height
        if height > length:
            problems.append(
                f"link {link.name}, {item.sensor.name}: height_mm must be at most {1e3 * length:g} mm, the distance "
                f"between the joints of the {arm}'s {link.name}, got {1e3 * height:g} mm"
            )
