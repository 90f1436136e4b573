"""A scene: what is there. What it does not name is neither imported, started nor computed.

``load`` reads it from a TOML file (docs/scene.md). Inside, everything is in SI and radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .geometry.placed import PlacedFrustum
    from .robot.commands import Reaction
    from .robot.rules import Rule
    from .robot.watch import Watch
    from .skin.scripted_touch import ScriptedTouch
    from .skin.sensor import Sensor

__all__ = [
    "ArmScene",
    "LinkScene",
    "MotionScene",
    "PlacedSensor",
    "RecordingScene",
    "Scene",
    "SourceScene",
    "load",
]


@dataclass(frozen=True, slots=True)
class ArmScene:
    """The arm.

    Attributes:
        model: such as "UR10e".
        host: the controller's name or address.
        watchdog_hz: the controller stops the program through which coneskin moves the arm when it hears nothing for
            1 / watchdog_hz.
        control: "owner": this program moves the arm, through ur_rtde; "foreign": something else does.
        table_z: height in the base frame that the arm does not go below while it retreats [m], or None.
    """

    model: str
    host: str
    watchdog_hz: float = 4.0
    control: str = "owner"
    table_z: float | None = None


@dataclass(frozen=True, slots=True)
class PlacedSensor:
    """A sensor and where it is.

    Attributes:
        sensor: the sensor.
        placed: its frustum in the frame of the link's mesh, or of its DH frame.
    """

    sensor: Sensor
    placed: PlacedFrustum


@dataclass(frozen=True, slots=True)
class LinkScene:
    """A link of the arm that carries sensors.

    Attributes:
        name: its name in the arm's URDF, such as "forearm".
        frame: "mesh", "urdf" or "dh": what the poses of its sensors refer to.
        mesh: the file of its mesh, or None.
        sensors: those on it.
    """

    name: str
    frame: str
    mesh: Path | None
    sensors: tuple[PlacedSensor, ...]


@dataclass(frozen=True, slots=True)
class SourceScene:
    """Where the bytes come from.

    Attributes:
        kind: "serial" or "virtual".
        port: of a serial source: device or pyserial URL.
        baud: of a serial source [bit/s].
        rate_hz: of a virtual source: frames per second of each sensor.
        seed: of a virtual source's noise.
        model: of a virtual source's sheets: "field", exactly, or "ladder", as ideal resistors.
        touches: of a virtual source.
    """

    kind: str
    port: str
    baud: int
    rate_hz: float
    seed: int
    model: str
    touches: tuple[ScriptedTouch, ...]


@dataclass(frozen=True, slots=True)
class RecordingScene:
    """Where runs are recorded.

    Attributes:
        folder: each run makes a folder in it.
    """

    folder: Path


@dataclass(frozen=True, slots=True)
class MotionScene:
    """A motion that the guard itself makes, over and over: for tests and demonstrations.

    Attributes:
        waypoints: joint positions [rad].
        speed: of the leading joint [rad/s].
        acceleration: of the leading joint [rad/s2].
        rounds: how often; 0 for ever.
    """

    waypoints: tuple[tuple[float, ...], ...]
    speed: float
    acceleration: float
    rounds: int


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that a scene file names; None or empty for what it does not.

    Attributes:
        name: of the file, for messages.
        text: the file itself, with the sensor files that it names written out, so that a recording is whole.
        folder: relative paths start here.
    """

    name: str
    text: str
    folder: Path
    arm: ArmScene | None = None
    links: tuple[LinkScene, ...] = ()
    source: SourceScene | None = None
    reaction: Reaction | None = None
    rules: tuple[Rule, ...] = ()
    watch: Watch | None = None
    recording: RecordingScene | None = None
    motion: MotionScene | None = None

    @property
    def sensors(self) -> tuple[PlacedSensor, ...]:
        """All sensors, in the order of the file."""
        return tuple(sensor for link in self.links for sensor in link.sensors)

    @property
    def any_touch(self) -> Reaction:
        """The reaction to a touch that no rule fits; a stop where the file names none."""
        from .robot.commands import Reaction

        return self.reaction or Reaction(kind="stop")

    @property
    def limits(self) -> Watch:
        """The limits of the watch; the defaults where the file names none."""
        from .robot.watch import Watch

        return self.watch or Watch()


def load(path: Path | str) -> Scene:
    """Read a scene from a TOML file.

    Raises:
        SceneError: the file cannot be read, or has mistakes; all of them are listed.
    """
    from .scene_reader import read_scene

    return read_scene(Path(path))
