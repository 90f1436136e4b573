"""Values of a reaction: its inputs, its settings and its answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coneskin.core.errors import RobotRefused
from coneskin.geometry.pose import Vector

if TYPE_CHECKING:
    from coneskin.robot.arm.model import Joints

#: what an arm can do when it is touched, gentlest first
KINDS = ("slow", "comply", "retreat", "stop")
#: what a motion away does where it would move outward what no skin covers
BARE_SIDES = ("stop", "allowed", "fast")


@dataclass(frozen=True, slots=True)
class ArmState:
    """Arm as measured at one time. Not checked: one is made in each control cycle."""

    time: float  #: of the measurement, on the clock of the guard [s]
    q: Joints  #: joint positions [rad]
    qd: Joints = ()  #: joint speeds [rad/s]; empty where it stands
    torque: Joints | None = None  #: from outside on the joints [N m]. None where it is not measured.
    doubt: Joints = ()  #: largest torque that was seen on each joint while nothing touched [N m]; empty for none


@dataclass(frozen=True, slots=True)
class ContactOnLink:
    """Touch on a link, as the reaction sees it."""

    link: int  #: index of the DH frame that moves with the touched link, 0 (base) to the flange
    point: Vector  #: where, in that frame [m]
    normal: Vector  #: outward unit normal of the skin there, in that frame; what touches is on its side
    level: float = 1.0  #: how strong, in the detector's unit
    location_valid: bool = True  #: False when it is known that there is a touch, but not where
    threshold: float = 0.0  #: level from which the sensor is touched at all
    number: int = 0  #: of the touch; one that begins anew has another
    firm: float = 0.2  #: level from which the touch should have a place; a firmer one without is a doubtful one


@dataclass(frozen=True, slots=True)
class Reaction:
    """Settings of a reaction to a touch.

    Attributes:
        kind: "stop"; "retreat" to stop and then move the touched point away; "comply" to stop and then give way as
            firmly as it is pushed; "slow" to go on slowly while the touch lasts.
        deceleration: of the leading joint while stopping [rad/s^2].
        distance: how far the touched point retreats, or gives way [m].
        speed: of the touched point [m/s]; of comply, at ``full_level``.
        acceleration: of the leading joint while retreating [rad/s^2].
        time_budget: after which the retreat ends wherever it is; a touch that slows for longer stops the arm [s].
        arm_speed: that no point of the bare arm exceeds while retreating [m/s]; a bound by the reach of each joint.
        arm_distance: that no point of the bare arm goes from where the motion began [m].
        full_level: level at which comply gives way with its full speed.
        bare_side: what a motion away does that would move a surface outward which no skin covers: "stop" does not
            begin it, "allowed" makes a retreat slowly, "fast" makes it as any other. ``bare_lead`` says which counts.
        slow_to: the controller's speed slider while slow, 0..1.
        slow_speed: of the touched surface, below which an arm counts as slow whatever it was before [m/s].
        press: how far the surface may move into a touch while the arm is slow, the way of a stop included; what
            moves into it faster is stopped at once [m].

    Raises:
        RobotRefused: a value is out of its range; no guard starts with such settings.
    """

    kind: str = "stop"
    deceleration: float = 10.0
    distance: float = 0.05
    speed: float = 0.15
    acceleration: float = 4.0
    time_budget: float = 2.0
    arm_speed: float = 0.25
    arm_distance: float = 0.1
    full_level: float = 0.6
    bare_side: str = "stop"
    slow_to: float = 0.2
    slow_speed: float = 0.05
    press: float = 0.0005

    def __post_init__(self) -> None:
        for name, choices in (("kind", KINDS), ("bare_side", BARE_SIDES)):
            if (word := getattr(self, name)) not in choices:
                raise RobotRefused(f"reaction {name} must be one of {', '.join(choices)}, got {word!r}")
        # 40 rad/s^2 is the most that the UR driver lets through; 1.5 m/s the fastest tool of that family
        for name, unit, most in (
            ("deceleration", "rad/s^2", 40.0),
            ("distance", "m", 0.5),
            ("speed", "m/s", 1.5),
            ("acceleration", "rad/s^2", 40.0),
            ("time_budget", "s", 60.0),
            ("arm_speed", "m/s", 5.0),
            ("arm_distance", "m", 2.0),
            ("full_level", "of 1", 1.0),
            ("slow_to", "of 1", 0.9),
            ("slow_speed", "m/s", 1.5),
            ("press", "m", 0.1),
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 < value <= most):
                raise RobotRefused(f"reaction {name} must be above 0 and at most {most} {unit}, got {value!r}")

    @property
    def moves(self) -> bool:
        """True where it moves the arm away from a touch, or gives way to it."""
        return self.kind in ("comply", "retreat")

    @property
    def bare_lead(self) -> str:
        """Return what counts of ``bare_side``: of comply, whose push a lever makes stronger, no "allowed"."""
        return "stop" if self.kind == "comply" and self.bare_side == "allowed" else self.bare_side


@dataclass(frozen=True, slots=True)
class JointVelocity:
    """Joint speeds to go to, ramped by the controller and then held.

    Attributes:
        qd: joint speeds [rad/s].
        acceleration: of the leading joint on the way there [rad/s^2].
        away: speed that the touched point will have away from the obstacle [m/s]; the mean over several touches.
        progress: how far it has got so far [m]; the farthest over several touches.
        clipped_by: what kept it from moving as set: "joint speed", "arm speed", "distance" or "arm distance"
            (it brakes for the end),
            "singularity", "joint 3 limit", "bare side" (what no skin covers leads); of comply also "level" (pushed less
            than fully), "damping", "place" (it is not known), "push" (the joints feel less of a push).
    """

    qd: Joints
    acceleration: float
    away: float
    progress: float
    clipped_by: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Done:
    """End of a motion, or its impossibility: brake and stand."""

    reason: str
    progress: float = 0.0  #: how far the touched point got [m]
    complete: bool = False  #: it got as far as it was to
