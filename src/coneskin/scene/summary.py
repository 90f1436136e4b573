"""Summary of a scene for people and programs, and what it lacks for a guard."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RobotRefused

from .build import bare_parts
from .tables.source_tables import source_label
from .values.scene import ArmScene, PlacedSensor, Scene

if TYPE_CHECKING:
    from coneskin.robot.reaction.rules import Rule
    from coneskin.robot.reaction.types import Reaction
    from coneskin.robot.stop.limits import MonitoringLimits
    from coneskin.skin.sensor import Sensor

#: arm.controller_heartbeat -> what it means
_HEARTBEAT_WORDS = {
    "required": "a program on the controller must depend on the guard's heartbeat (coneskin heartbeat)",
    "optional": "NOT REQUIRED: a program without the lines of coneskin heartbeat goes on if the network is cut",
}
#: reaction.bare_side -> what it means
_BARE_WORDS = {
    "stop": "; not towards what no skin covers",
    "allowed": "; TOWARDS WHAT NO SKIN COVERS at up to 8 mm/s",
    "fast": "; TOWARDS WHAT NO SKIN COVERS as fast as elsewhere",
}


_FEWEST_FRAMES = 2  # for which a skin may be silent; with less each frame would be late


def missing_parts(scene: Scene) -> list[str]:
    """Return what has to be added before the scene can be guarded, one line each."""
    needed = {"[source]": scene.source, "[[link]] with a [[link.sensor]]": scene.sensors}
    lines = [f"a guard needs a {name}" for name, part in needed.items() if not part]
    rate, silence = scene.source.settings.get("rate") if scene.source else None, scene.monitoring_limits.skin_silence
    if rate is not None and silence * rate < _FEWEST_FRAMES:
        least = 1e3 * _FEWEST_FRAMES / rate
        said = f"monitoring.skin_silence_ms = {1e3 * silence:g} is too short for source.rate_hz = {rate:g}"
        lines.append(f"{said}: it must be at least {least:g}, the time of {_FEWEST_FRAMES} frames")
    return lines + (_missing_tiers(scene, scene.arm) if scene.arm else [])


def _missing_tiers(scene: Scene, arm: ArmScene) -> list[str]:
    """Return what the scene asks of its arm that the arm's driver cannot; that of UR arms can all."""
    from coneskin.robot.arm.models import is_ur

    model = arm.arm_model
    if is_ur(model):
        return []
    from coneskin.robot.driver.protocol import HeartbeatDriver, ProgramDriver, SetpointDriver, SliderDriver, require

    internal, lines = arm.control == "internal", []
    slows = "slow" in {scene.default_reaction.kind, *(rule.reaction.kind for rule in scene.rules)}
    wanted = {
        ProgramDriver: internal,
        SetpointDriver: scene.moves_away and not internal,
        SliderDriver: slows or scene.speed_limit is not None,
        HeartbeatDriver: not internal and arm.controller_heartbeat == "required",
    }
    for tier in (tier for tier, needed in wanted.items() if needed):
        try:
            require(arm.driver, tier)
        except RobotRefused as exc:
            lines.append(f"{model.name}: {exc}")
    if scene.moves_away and model.currents is None:
        lines.append(f'{model.name}: its model has no currents, so nothing may move it away; reaction = "stop" works')
    return lines


def summarize(scene: Scene) -> dict[str, Any]:
    """Return what the scene has, a name and a sentence each; limits that have their defaults are included."""
    found: dict[str, Any] = {"scene": scene.name}
    if scene.arm:
        table = "" if scene.arm.table_z is None else f", table at z = {1e3 * scene.arm.table_z:g} mm"
        found["arm"] = f"{scene.arm.model} at {scene.arm.host}, control {scene.arm.control}{table}"
        if scene.arm.control == "external":
            found["heartbeat"] = _HEARTBEAT_WORDS[scene.arm.controller_heartbeat]
    for link in scene.links:
        for item in link.sensors:
            found[f"sensor {item.sensor.name}"] = _sensor(item, link.name, link.frame)
            if item.sensor.place_map:
                note = item.sensor.place_map.note or "numbers of the scene"
                found[f"calibration of {item.sensor.name}"] = note
            found[f"place on {item.sensor.name}"] = _certainty(item.sensor, scene.arm is not None)
    if scene.source:
        found["source"] = source_label(scene.source)
    if scene.arm:
        found["reaction"] = _reaction(scene.default_reaction)
        if bare := bare_parts(scene):
            found["no skin on"] = (
                f"all or a part of {bare}; where one would lead, the arm only stops: cover it, or write bare_side"
            )
        if scene.commissioning:
            valid, note = scene.commissioning.valid, scene.commissioning.note
            found["commissioning"] = note if valid else f"NOT VALID: the arm only stops; {note}"
    for number, rule in enumerate(scene.rules, 1):
        found[f"rule {number}"] = f"{_reaction(rule.reaction)}, {_conditions(rule)}"
    if limit := scene.speed_limit:
        where = "in the positions of a motion" if limit.lowest else "in any position"
        found["permissible speeds"] = (
            f"by {limit.edition}, verified by {limit.verified_by}, computed {limit.date[:10]} {where}; at most "
            f"{max(map(max, limit.curves)):.2f} m/s along a normal, kept by the speed slider"
        )
    if scene.source:
        found["monitoring"] = _monitoring(scene.monitoring_limits, scene.arm is not None)
    if scene.source and scene.source.touches:
        found["touches"] = str(len(scene.source.touches))
    if scene.motion:
        found["motion"] = f"{len(scene.motion.waypoints)} waypoints, rounds: {scene.motion.rounds or 'no end'}"
    if scene.recording:
        found["recording"] = str(scene.recording.folder)
    return found


def _sensor(item: PlacedSensor, link: str, frame: str) -> str:
    sensor, cone, pose = item.sensor, item.sensor.frustum, item.placed.link_frustum
    place = ", ".join(f"{1e3 * x:g}" for x in pose.translation)
    turn = ", ".join(f"{math.degrees(x):g}" for x in pose.rpy)
    return (
        f"id {sensor.number} on the {link}: radius {1e3 * cone.radius1:g} to "
        f"{1e3 * cone.radius2:g} mm, height {1e3 * cone.height:g} mm, wrap {math.degrees(cone.wrap):g} deg, "
        f"at ({place}) mm, rpy ({turn}) deg, in the {frame} frame"
    )


def _certainty(sensor: Sensor, arm: bool) -> str:
    """Return when a touch's place is certain, and what that excludes."""
    from coneskin.skin.detection.frame.settings import DetectorSettings
    from coneskin.skin.detection.place.single_contact import (
        DANGEROUS_ANGLE,
        frames_until_certain,
        weakest_pair_excluded,
    )

    settings = DetectorSettings()
    frames = frames_until_certain(sensor, settings)
    wanted, reached = 1e3 * settings.second_contact, 1e3 * weakest_pair_excluded(sensor, 512)
    if frames is None:
        return (
            f"this sensor's place never becomes certain{': the arm only stops' if arm else ''}; its readings are too "
            f"coarse to exclude a second contact of about 2 N ({wanted:g} millisiemens), only one of {reached:.2g}"
        )
    return (
        f"certain after about {frames} frame{'s' if frames > 1 else ''} of a firm touch: then a second contact of "
        f"about 2 N ({wanted:g} millisiemens), {math.degrees(DANGEROUS_ANGLE):.0f} deg off, is excluded; after 512 "
        f"frames one of {reached:.2g} millisiemens"
    )


def _reaction(reaction: Reaction) -> str:
    """Return what the arm does, with the settings that matter to it."""
    stop = f"braking at {reaction.deceleration:g} rad/s2"
    if reaction.kind == "stop":
        return f"stop, {stop}"
    if reaction.kind == "slow":
        return (
            f"slow to {100.0 * reaction.slow_to:g} % for at most {reaction.time_budget:g} s, and no more than "
            f"{1e3 * reaction.press:g} mm into the touch; then, or where it would be more, stop, {stop}"
        )
    text = (
        f"{reaction.kind}: stop, {stop}, then at most {1e3 * reaction.distance:g} mm at up to {1e3 * reaction.speed:g} "
        f"mm/s within {reaction.time_budget:g} s, no point of the arm farther than {1e3 * reaction.arm_distance:g} mm "
        f"or faster than {1e3 * reaction.arm_speed:g} mm/s{_BARE_WORDS[reaction.bare_lead]}"
    )
    if reaction.kind == "retreat":
        return text
    return f"{text}, with full speed at level {reaction.full_level:g} of the touch (0 to 1)"


def _conditions(rule: Rule) -> str:
    from coneskin.robot.arm.kinematics import link_name

    said = []
    if rule.link is not None:
        said.append(f"touched on the {link_name(rule.link)}")
    if rule.level_above is not None:
        said.append(f"level above {rule.level_above:g}")
    if rule.speed_above is not None:
        said.append(f"arm faster than {rule.speed_above:g} rad/s")
    return "where " + " and ".join(said) if said else "always"


def _monitoring(limits: MonitoringLimits, arm: bool) -> str:
    text = f"skin silent or late for {1e3 * limits.skin_silence:g} ms"
    if limits.stuck_frames:
        text += f" or without noise for {limits.stuck_frames} frames"
    if not arm:
        return f"{text}: a fault"
    return (
        f"{text}, controller silent for {1e3 * limits.arm_silence:g} ms, program silent for "
        f"{1e3 * limits.program_silence:g} ms: stop; next stop path after "
        f"{1e3 * limits.escalate:g} ms without slowdown; standing below {limits.standstill:g} rad/s"
    )
