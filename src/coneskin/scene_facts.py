"""What a scene has, in words for people and programs, and what it lacks for a guard."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .robot.commands import Reaction
    from .robot.rules import Rule
    from .robot.watch import Watch
    from .scene import PlacedSensor, Scene

__all__ = ["facts", "lacks"]


def lacks(scene: Scene) -> list[str]:
    """What has to be added before the scene can be guarded, one line each."""
    needed = {"[source]": scene.source, "[[link]] with a [[link.sensor]]": scene.sensors}
    return [f"a guard needs a {name}" for name, part in needed.items() if not part]


def facts(scene: Scene) -> dict[str, Any]:
    """What is there: a name and a sentence each; the limits too, where they are the default."""
    found: dict[str, Any] = {"scene": scene.name}
    if scene.arm:
        table = "" if scene.arm.table_z is None else f", table at z = {1e3 * scene.arm.table_z:g} mm"
        found["arm"] = f"{scene.arm.model} at {scene.arm.host}, control {scene.arm.control}{table}"
    for link in scene.links:
        for item in link.sensors:
            found[f"sensor {item.sensor.name}"] = _sensor(item, link.name, link.frame)
    if scene.source:
        found["source"] = scene.source.kind + (f" {scene.source.port}" if scene.source.port else "")
    if scene.arm:
        found["reaction"] = _reaction(scene.any_touch)
    for number, rule in enumerate(scene.rules, 1):
        found[f"rule {number}"] = f"{_reaction(rule.reaction)}, {_conditions(rule)}"
    if scene.source:
        found["watch"] = _watch(scene.limits, scene.arm is not None)
    if scene.source and scene.source.touches:
        found["touches"] = str(len(scene.source.touches))
    if scene.motion:
        found["motion"] = f"{len(scene.motion.waypoints)} waypoints, {scene.motion.rounds or 'endless'} rounds"
    if scene.recording:
        found["recording"] = str(scene.recording.folder)
    return found


def _sensor(item: PlacedSensor, link: str, frame: str) -> str:
    sensor, cone, pose = item.sensor, item.sensor.frustum, item.placed.link_frustum
    place = ", ".join(f"{1e3 * x:g}" for x in pose.translation)
    turn = ", ".join(f"{math.degrees(x):g}" for x in pose.rpy)
    return (
        f"id {sensor.device_id}/{sensor.sensor_id} on the {link}: radius {1e3 * cone.radius1:g} to "
        f"{1e3 * cone.radius2:g} mm, height {1e3 * cone.height:g} mm, wrap {math.degrees(cone.wrap):g} deg, "
        f"at ({place}) mm, rpy ({turn}) deg, in the {frame} frame"
    )


def _reaction(reaction: Reaction) -> str:
    """What the arm does, with the settings that matter to it."""
    stop = f"braking at {reaction.deceleration:g} rad/s2"
    if reaction.kind == "stop":
        return f"stop, {stop}"
    if reaction.kind == "slow":
        return f"slow to {100.0 * reaction.slow_to:g} % for at most {reaction.time_budget:g} s, then stop, {stop}"
    text = (
        f"{reaction.kind}: stop, {stop}, then at most {1e3 * reaction.distance:g} mm at up to "
        f"{1e3 * reaction.speed:g} mm/s within {reaction.time_budget:g} s, no point of the arm faster than "
        f"{1e3 * reaction.arm_speed:g} mm/s"
    )
    if reaction.kind == "comply":
        return f"{text}, with full speed at level {reaction.full_level:g}"
    return text + ("; else back along its path" if reaction.fallback == "path" else "")


def _conditions(rule: Rule) -> str:
    from .robot.link_frames import LINK_INDEX

    said = []
    if rule.link is not None:
        said.append(f"touched on the {next(name for name, index in LINK_INDEX.items() if index == rule.link)}")
    if rule.level_above is not None:
        said.append(f"level above {rule.level_above:g}")
    if rule.speed_above is not None:
        said.append(f"arm faster than {rule.speed_above:g} rad/s")
    return "where " + " and ".join(said) if said else "always"


def _watch(watch: Watch, arm: bool) -> str:
    text = f"skin silent for {1e3 * watch.skin_silence:g} ms or late by {1e3 * watch.skin_late:g} ms"
    if watch.stuck_frames:
        text += f" or without noise for {watch.stuck_frames} frames"
    if not arm:
        return f"{text}: a fault"
    return (
        f"{text}, controller silent for {1e3 * watch.arm_silence:g} ms: stop; next way to stop after "
        f"{1e3 * watch.escalate:g} ms without slowdown; standing below {watch.standstill:g} rad/s"
    )
