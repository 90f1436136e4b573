"""Values of a scene, in SI and radians.

What a scene does not name is neither imported, started nor computed. ``reader`` reads one from a TOML file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.geometry.pose import Vector
    from coneskin.robot.arm.model import ArmModel
    from coneskin.robot.driver.protocol import ArmDriver
    from coneskin.robot.reaction.rules import Rule
    from coneskin.robot.reaction.types import Reaction
    from coneskin.robot.stop.limits import MonitoringLimits
    from coneskin.skin.materials import Padding
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch

#: kind of a body -> what it is
BODY_KINDS = {
    "wall": "a plate that does not give way",
    "post": "a round bar that does not give way",
    "mass": "a free mass that nothing holds",
    "hand": "a mass on a spring: a hand, or a head",
    "person": "a hand that pushes back, some time after it was touched",
    "grip": "two hands that close on the link from both sides, some time after one was touched",
}


@dataclass(frozen=True, slots=True)
class BodyScene:
    """Body that the arm may run into. Stiffness and effective mass are the user's: none is known that holds for all.

    Attributes:
        kind: of `BODY_KINDS`.
        place: of its middle, in the base frame [m]; of a wall, the middle of its face; of a grip, of the first hand.
        direction: outward normal of a wall, axis of a post, way from the first to the second hand of a grip.
        radius: of a ball or a bar [m]; half the edge of a wall.
        length: of a bar [m].
        mass: effective mass [kg].
        stiffness: of the spring that holds it [N/m].
        damping: of that spring, as a share of what is critical.
        force: that a person wants, or each hand of a grip [N].
        speed: at which a person follows or yields at most [m/s].
        delay: from the first contact to the person's push, or the closing of the grip [s].
    """

    kind: str
    place: Vector
    direction: Vector = (1.0, 0.0, 0.0)
    radius: float = 0.04
    length: float = 0.3
    mass: float = 1.0
    stiffness: float = 0.0
    damping: float = 0.3
    force: float = 0.0
    speed: float = 0.25
    delay: float = 0.15

    @property
    def gives_way(self) -> bool:
        """True for a body that moves when it is pushed."""
        return self.kind not in ("wall", "post")

    @property
    def parts(self) -> tuple[Vector, ...]:
        """Places of its parts [m]: two of a grip, one of any other."""
        if self.kind != "grip":
            return (self.place,)
        x, y, z = (p + d for p, d in zip(self.place, self.direction, strict=True))
        return self.place, (x, y, z)

    @property
    def axis(self) -> Vector:
        """Unit vector of ``direction``."""
        x, y, z = self.direction
        length = math.sqrt(x * x + y * y + z * z)
        return x / length, y / length, z / length


@dataclass(frozen=True, slots=True)
class LimitedPatch:
    """Patch of a skin whose speed is limited."""

    sensor: str  #: its name
    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth [rad]
    curve: int  #: number of the curve that holds within the joint positions of the motion
    any_curve: int  #: number of the one that holds in any


@dataclass(frozen=True, slots=True)
class SpeedLimitScene:
    """Permissible speeds of the skins of a scene.

    Attributes:
        fingerprint: of what they hold for; see ``speed_limit_tables.limit_fingerprint``.
        date: when they were computed, UTC.
        coneskin: the version.
        edition: document and edition that the limits of the force are from.
        transcribed_by: who copied them from it.
        verified_by: who compared them with it.
        measured_by: what measured reaction time and deceleration.
        reaction: from the closing of the layers until the arm brakes [s].
        deceleration: of the leading joint then [rad/s^2].
        lowest: joint positions [rad] from which on the patches' own curves hold; empty where only the others do.
        highest: joint positions [rad] up to which they do.
        levers: speed of a patch along its normal over that of the leading joint [m/rad], rising.
        curves: permissible speeds along the normal [m/s], one for each lever.
        patches: of the skins.
    """

    fingerprint: str
    date: str
    coneskin: str
    edition: str
    transcribed_by: str
    verified_by: str
    measured_by: str
    reaction: float
    deceleration: float
    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    levers: tuple[float, ...]
    curves: tuple[tuple[float, ...], ...]
    patches: tuple[LimitedPatch, ...]


@dataclass(frozen=True, slots=True)
class ArmScene:
    """Arm of a scene.

    Attributes:
        model: such as "UR10e".
        host: the controller's name or address.
        watchdog_hz: the controller ends the program through which coneskin moves the arm when it receives nothing for
            1 / watchdog_hz.
        control: "internal": a program moves the arm through the driver process; "external": another program moves it.
        slider_stop: the guard takes the controller's speed slider, as one more way to stop the arm.
        controller_heartbeat: "required": a program that the controller does not end without the guard's heartbeat is
            stopped; "optional": it is reported.
        payload: the heaviest that the flange carries, tool included [kg].
        payload_xyz: its centre of mass in the flange's frame [m].
        table_z: height in the base frame that the arm does not go below while it retreats [m], or None.
    """

    model: str
    host: str
    watchdog_hz: float = 4.0
    control: str = "internal"
    table_z: float | None = None
    slider_stop: bool = True
    controller_heartbeat: str = "optional"
    payload: float = 0.0
    payload_xyz: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def arm_model(self) -> ArmModel:
        """Geometry and limits of the arm of that name."""
        from coneskin.robot.arm.models import arm_model

        return arm_model(self.model)

    @property
    def driver(self) -> ArmDriver:
        """Driver of its controller."""
        from coneskin.robot.driver.protocol import load_driver

        return load_driver(self.arm_model.driver)


@dataclass(frozen=True, slots=True)
class PlacedSensor:
    """Sensor and its place."""

    sensor: Sensor
    placed: PlacedFrustum  #: its frustum in the frame of the link's mesh, or of its DH frame


@dataclass(frozen=True, slots=True)
class LinkScene:
    """Link of the arm that carries sensors."""

    name: str  #: its name in the arm's URDF, such as "forearm"
    frame: str  #: "mesh", "urdf" or "dh": what the poses of its sensors refer to
    mesh: Path | None  #: the file of its mesh, or None
    sensors: tuple[PlacedSensor, ...]  #: on the link


@dataclass(frozen=True, slots=True)
class SourceScene:
    """Source of the skin's bytes.

    Attributes:
        kind: one of `coneskin.skin.sources.kinds.SOURCE_KINDS`, such as "serial" or "virtual"; ``GROUP`` for several.
        settings: values of the keys of that kind, in SI, under their names without the unit.
        touches: script of a simulated source.
    """

    kind: str
    settings: Mapping[str, Any]
    touches: tuple[ScriptedTouch, ...] = ()


@dataclass(frozen=True, slots=True)
class RecordingScene:
    """Place where runs are recorded.

    Attributes:
        folder: each run makes a folder in it.
        max_size: of a file, from which on a run goes on in a new one [bytes]; None for one file.
        keep: newest files of a run that stay whole; in older ones only events stay, and what was recorded around
            touches, stops and faults. None for all.
    """

    folder: Path
    max_size: int | None = None
    keep: int | None = None


@dataclass(frozen=True, slots=True)
class MotionScene:
    """Motion that the guard itself makes, over and over: for tests and demonstrations."""

    waypoints: tuple[tuple[float, ...], ...]  #: joint positions [rad]
    speed: float  #: of the leading joint [rad/s]
    acceleration: float  #: of the leading joint [rad/s2]
    rounds: int  #: their number; 0 for no end


@dataclass(frozen=True, slots=True)
class Commissioning:
    """Whether the reactions of a scene may move its arm away from a touch. Without it they only stop the arm.

    Attributes:
        valid: the places that the skin reads were compared with places that were touched.
        note: for people: how that is known, or why not.
        sheet_ohm: what the untouched sheets of each sensor, by its number, had per square then, upper and lower [ohm].
            A guard compares: nothing else tells an electrode that has peeled off before it starts.
    """

    valid: bool
    note: str
    sheet_ohm: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def from_message(cls, message: Any) -> Commissioning | None:
        """Return what another process or a recording says of it: ``asdict`` of one, None for None.

        Raises:
            ValueError: the message is nothing of the kind.
        """
        if message is None:
            return None
        if not (isinstance(message, dict) and message.get("valid") in (True, False) and "note" in message):
            raise ValueError(f"a commissioning needs valid and note, got {message!r}")
        known = {str(name): (float(u), float(v)) for name, (u, v) in dict(message.get("sheet_ohm", {})).items()}
        return cls(bool(message["valid"]), str(message["note"]), known)


@dataclass(frozen=True, slots=True)
class Scene:
    """Content of a scene file; None or empty for what it does not name.

    Attributes:
        name: of the file, for messages.
        text: the file itself, with the sensor files that it names written out, so that a recording is whole.
        folder: where relative paths start.
        commissioning_max_age: age from which on a commissioning record is void [s]; None: never.
        commissioning: None where nobody has looked yet: ``with_commissioning`` then reads the record beside the file. A
            program that knows better says so with ``dataclasses.replace``.
        bodies: that the arm may run into, in the physics engine.
        padding: of the skins, for the physics engine; None where the file names none.
        speed_limit: how fast its skins may move towards what they could strike; None where nothing limits them.
    """

    name: str
    text: str
    folder: Path
    arm: ArmScene | None = None
    links: tuple[LinkScene, ...] = ()
    source: SourceScene | None = None
    reaction: Reaction | None = None
    rules: tuple[Rule, ...] = ()
    monitoring: MonitoringLimits | None = None
    recording: RecordingScene | None = None
    motion: MotionScene | None = None
    commissioning_max_age: float | None = None
    commissioning: Commissioning | None = None
    bodies: tuple[BodyScene, ...] = ()
    padding: Padding | None = None
    speed_limit: SpeedLimitScene | None = None

    @property
    def sensors(self) -> tuple[PlacedSensor, ...]:
        """All sensors, in the order of the file."""
        return tuple(sensor for link in self.links for sensor in link.sensors)

    @property
    def arm_label(self) -> str:
        """The arm as log lines name it, such as ``UR5e at 10.0.0.2``; empty where there is none."""
        return f"{self.arm.model} at {self.arm.host}" if self.arm else ""

    @property
    def default_reaction(self) -> Reaction:
        """Reaction to a touch that no rule fits; a stop where the file names none."""
        from coneskin.robot.reaction.types import Reaction

        return self.reaction or Reaction(kind="stop")

    @property
    def moves_away(self) -> bool:
        """True where a reaction of the scene moves the arm away from a touch, or gives way to it."""
        if self.arm is None:
            return False
        from coneskin.robot.reaction.rules import RuleSet

        return RuleSet(self.default_reaction, self.rules).move

    @property
    def monitoring_limits(self) -> MonitoringLimits:
        """Limits of the monitoring; the defaults where the file names none."""
        from coneskin.robot.stop.limits import MonitoringLimits

        return self.monitoring or MonitoringLimits()


_FACT_DIGITS = 9  # of a number in a fingerprint; the last bits of a sine may differ between machines


def sensor_facts(sensor: Sensor) -> dict[str, Any]:
    """Return numbers, geometry, polarity, electronics and sheets of a sensor; not name, thresholds and place map."""
    return {
        "number": [sensor.device_id, sensor.sensor_id],
        "frustum": asdict(sensor.frustum),
        "polarity": asdict(sensor.polarity),
        "electronics": asdict(sensor.electronics),
        "sheets": [sensor.upper_sheet_ohms, sensor.lower_sheet_ohms],
    }


def facts_digest(facts: Any) -> str:
    """Return a hash of facts, with each number rounded, so that those of two machines agree."""
    import hashlib  # not at each start

    return hashlib.sha256(json.dumps(_rounded(facts), sort_keys=True).encode()).hexdigest()


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, _FACT_DIGITS) + 0.0  # no negative zero
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    return [_rounded(item) for item in value] if isinstance(value, list | tuple) else value
