"""A scene: what is there. What it does not name is neither imported, started nor computed.

``load`` reads it from a TOML file (docs/scene.md). Inside, everything is in SI and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .geometry.placed import PlacedFrustum
    from .skin.sensor import Sensor

__all__ = [
    "ArmScene",
    "LinkScene",
    "MotionScene",
    "PlacedSensor",
    "ReactionScene",
    "RecordingScene",
    "Scene",
    "SourceScene",
    "TouchScene",
    "WatchScene",
    "load",
]


@dataclass(frozen=True, slots=True)
class ArmScene:
    """The arm.

    Attributes:
        model: such as "UR10e".
        host: the controller's name or address.
        watchdog_hz: the controller stops its program when it hears nothing for 1 / watchdog_hz.
    """

    model: str
    host: str
    watchdog_hz: float


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
        frame: "mesh" or "dh": what the poses of its sensors refer to.
        mesh: the file of its mesh, or None.
        sensors: those on it.
    """

    name: str
    frame: str
    mesh: Path | None
    sensors: tuple[PlacedSensor, ...]


@dataclass(frozen=True, slots=True)
class TouchScene:
    """A touch of the virtual skin.

    Attributes:
        sensor: id of the sensor touched.
        start: when it begins [s].
        end: when it ends [s].
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        level: how firmly, in (0, 1).
    """

    sensor: int
    start: float
    end: float
    u: float
    phi: float
    level: float


@dataclass(frozen=True, slots=True)
class SourceScene:
    """Where the bytes come from.

    Attributes:
        kind: "serial" or "virtual".
        port: of a serial source: device or pyserial URL.
        baud: of a serial source [bit/s].
        rate_hz: of a virtual source: frames per second of each sensor.
        seed: of a virtual source's noise.
        touches: of a virtual source.
    """

    kind: str
    port: str
    baud: int
    rate_hz: float
    seed: int
    touches: tuple[TouchScene, ...]


@dataclass(frozen=True, slots=True)
class ReactionScene:
    """What the arm does when it is touched.

    Attributes:
        kind: "stop" or "retreat".
        deceleration: of the leading joint when stopping [rad/s2].
        distance: of a retreat [m].
        speed: of the touched point in a retreat [m/s].
        acceleration: of the leading joint in a retreat [rad/s2].
        time: longest retreat [s].
    """

    kind: str = "stop"
    deceleration: float = 10.0
    distance: float = 0.05
    speed: float = 0.1
    acceleration: float = 2.0
    time: float = 2.0


@dataclass(frozen=True, slots=True)
class WatchScene:
    """How long silence may last, and what counts as standing.

    Attributes:
        skin_silence: longest age of a sensor's newest valid frame [s].
        arm_silence: longest age of the controller's newest state [s].
        escalate: without slowdown for this long after a stop, the next way to stop is taken [s].
        standstill: joint speed below which the arm stands [rad/s].
    """

    skin_silence: float = 0.05
    arm_silence: float = 0.05
    escalate: float = 0.025
    standstill: float = 0.01


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
        text: the file itself, so that a recording can carry it.
        folder: relative paths start here.
    """

    name: str
    text: str
    folder: Path
    arm: ArmScene | None = None
    links: tuple[LinkScene, ...] = ()
    source: SourceScene | None = None
    reaction: ReactionScene | None = None
    watch: WatchScene = field(default_factory=WatchScene)
    recording: RecordingScene | None = None
    motion: MotionScene | None = None

    @property
    def sensors(self) -> tuple[PlacedSensor, ...]:
        """All sensors, in the order of the file."""
        return tuple(sensor for link in self.links for sensor in link.sensors)


def load(path: Path | str) -> Scene:
    """Read a scene from a TOML file.

    Raises:
        SceneError: the file cannot be read, or has mistakes; all of them are listed.
    """
    from .scene_reader import read_scene

    return read_scene(Path(path))
