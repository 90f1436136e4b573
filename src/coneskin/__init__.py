"""Touch-sensitive skin for robot arms: design it, guard an arm with it, replay its collisions.

    import coneskin as cs

    with cs.guard("scene.toml") as session:
        session.arm.move_j(q, speed=1.0, acceleration=2.0)    # raises cs.Collision after the arm has stopped

Everything in ``__all__`` is public; everything else may move. Importing this package loads none of it.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .commissioning.acceptance.commission import commission_virtual_skin as commission_virtual_skin
    from .core.errors import Collision as Collision
    from .core.errors import ConeSkinError as ConeSkinError
    from .core.errors import FieldError as FieldError
    from .core.errors import GeometryError as GeometryError
    from .core.errors import KinematicsError as KinematicsError
    from .core.errors import MeshError as MeshError
    from .core.errors import MissingExtra as MissingExtra
    from .core.errors import RecordingError as RecordingError
    from .core.errors import RobotConnectionError as RobotConnectionError
    from .core.errors import RobotError as RobotError
    from .core.errors import RobotRefused as RobotRefused
    from .core.errors import RobotTimeout as RobotTimeout
    from .core.errors import SceneError as SceneError
    from .core.errors import SensorError as SensorError
    from .core.errors import SkinConnectionError as SkinConnectionError
    from .core.errors import SkinError as SkinError
    from .core.errors import SkinTimeout as SkinTimeout
    from .core.version import __version__ as __version__
    from .design.folder import write_design as write_design
    from .design.link_design import LinkDesign as LinkDesign
    from .design.link_design import design_link as design_link
    from .design.sheets.sheet_design import DesignOptions as DesignOptions
    from .design.sheets.sheet_design import design_sheets as design_sheets
    from .geometry.fit.cones import find_cones as find_cones
    from .geometry.fit.fit_options import FitOptions as FitOptions
    from .geometry.frustum import Frustum as Frustum
    from .geometry.frustum import Sector as Sector
    from .geometry.frustum import roll_up as roll_up
    from .geometry.frustum import unroll as unroll
    from .geometry.mesh import load_mesh as load_mesh
    from .geometry.placed_frustum import PlacedFrustum as PlacedFrustum
    from .geometry.pose import Pose as Pose
    from .robot.arm.models import arm_model as arm_model
    from .robot.driver.values import Waypoint as Waypoint
    from .robot.guard.signals.journal import EventName as EventName
    from .robot.guard.signals.journal import GuardEvent as GuardEvent
    from .robot.reaction.rules import Rule as Rule
    from .robot.reaction.types import Reaction as Reaction
    from .robot.sim.process import SimulatedController as SimulatedController
    from .runs.replay.run import Run as Run
    from .runs.replay.run import read_run as read_run
    from .runs.what_if.what_if import judge_runs as judge_runs
    from .runs.what_if.what_if import what_if as what_if
    from .scene.build import place_on_arm as place_on_arm
    from .scene.reader import load_scene as load_scene
    from .scene.reader import parse_scene as parse_scene
    from .scene.values.scene import Commissioning as Commissioning
    from .scene.values.scene import Scene as Scene
    from .session.session import Session as Session
    from .session.session import guard as guard
    from .skin.detection.events import SkinFault as SkinFault
    from .skin.detection.events import TouchBegan as TouchBegan
    from .skin.detection.events import TouchEnded as TouchEnded
    from .skin.detection.events import TouchMoved as TouchMoved
    from .skin.detection.stream import TouchStream as TouchStream
    from .skin.field.model import FieldModel as FieldModel
    from .skin.sensor import Sensor as Sensor
    from .skin.sources.serial_port import SerialPort as SerialPort
    from .skin.sources.source import Source as Source
    from .skin.virtual.fault_injection import FaultInjection as FaultInjection
    from .skin.virtual.place_frames import PlaceFrames as PlaceFrames
    from .skin.virtual.pseudo_terminal import PseudoTerminal as PseudoTerminal
    from .skin.virtual.scripted_touch import ScriptedTouch as ScriptedTouch
    from .skin.virtual.skin import VirtualSkin as VirtualSkin

#: module -> the public names in it; a test compares them with the imports above
_PUBLIC = {
    "commissioning.acceptance.commission": "commission_virtual_skin",
    "design.folder": "write_design",
    "design.link_design": "LinkDesign design_link",
    "design.sheets.sheet_design": "DesignOptions design_sheets",
    "core.version": "__version__",
    "core.errors": "Collision ConeSkinError FieldError GeometryError KinematicsError MeshError MissingExtra "
    "RecordingError RobotConnectionError RobotError RobotRefused RobotTimeout SceneError SensorError "
    "SkinConnectionError SkinError SkinTimeout",
    "geometry.fit.cones": "find_cones",
    "geometry.fit.fit_options": "FitOptions",
    "geometry.frustum": "Frustum Sector roll_up unroll",
    "geometry.mesh": "load_mesh",
    "geometry.placed_frustum": "PlacedFrustum",
    "geometry.pose": "Pose",
    "runs.replay.run": "Run read_run",
    "robot.arm.models": "arm_model",
    "robot.driver.values": "Waypoint",
    "robot.guard.signals.journal": "EventName GuardEvent",
    "robot.reaction.rules": "Rule",
    "robot.reaction.types": "Reaction",
    "robot.sim.process": "SimulatedController",
    "runs.what_if.what_if": "judge_runs what_if",
    "scene.build": "place_on_arm",
    "scene.reader": "load_scene parse_scene",
    "scene.values.scene": "Commissioning Scene",
    "session.session": "Session guard",
    "skin.detection.events": "SkinFault TouchBegan TouchEnded TouchMoved",
    "skin.detection.stream": "TouchStream",
    "skin.field.model": "FieldModel",
    "skin.sensor": "Sensor",
    "skin.sources.serial_port": "SerialPort",
    "skin.sources.source": "Source",
    "skin.virtual.fault_injection": "FaultInjection",
    "skin.virtual.place_frames": "PlaceFrames",
    "skin.virtual.pseudo_terminal": "PseudoTerminal",
    "skin.virtual.scripted_touch": "ScriptedTouch",
    "skin.virtual.skin": "VirtualSkin",
}
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
__all__ = [*_HOMES]


def __getattr__(name: str) -> object:
    """Load a public name when it is asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
