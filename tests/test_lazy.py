"""What a scene leaves out is not imported: each case in a fresh interpreter, judged by sys.modules."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from .scene.scenes import DOUBLE_CONE, SERIAL_RETREAT, SKIN_ONLY, record

pytestmark = pytest.mark.long

NUMERIC = {"numpy", "scipy"}
DEVICES = {"serial", "rtde_control", "rtde_receive", "rtde_io", "dashboard_client"}
DRAWING = {"trimesh", "matplotlib", "ezdxf", "collada", "embreex", "tomli_w"}
PAGE = {"viser", "websockets", "msgspec", "coneskin.view"}
ENGINE = {"mujoco", "coneskin.impact.simulation"}
HEAVY = NUMERIC | DEVICES | DRAWING | PAGE | ENGINE
VIRTUAL = {
    "coneskin.skin.virtual.skin",
    "coneskin.skin.virtual.circuit",
    "coneskin.skin.virtual.pseudo_terminal",
}
FIELD = {"coneskin.skin.field", "coneskin.skin.virtual.field_contacts"}
KINEMATICS = {"coneskin.robot.arm.kinematics", "coneskin.robot.arm.damped_least_squares"}
SIMULATOR = {"coneskin.robot.sim.machine.controller", "coneskin.robot.sim.process", "coneskin.robot.sim.server"}
CALIBRATION = {
    "coneskin.commissioning.calibration",
    "coneskin.scene.values.calibration_file",
    "coneskin.skin.calibration",
}
LOADED = "coneskin.geometry.frustum", "coneskin.skin.sensor"

_LOAD = "from coneskin.scene.reader import load_scene; scene = load_scene({scene!r})"
_BUILD = _LOAD + "; from coneskin.scene.build import build_core; build_core(scene)"
_BUILD_COMMISSIONED = (
    _LOAD + "; from tests.support.scenes import commissioned"
    "; from coneskin.scene.build import build_core; build_core(commissioned(scene))"
)
_SERIAL_FREE = SKIN_ONLY[: SKIN_ONLY.index("[source]")]
_NO_TOUCH = SKIN_ONLY[: SKIN_ONLY.index("[[source.touch]]")]
_NO_MESH_FRAME = SERIAL_RETREAT.replace('name = "upper_arm"', 'name = "upper_arm"\nframe = "dh"')
_STOP = _NO_MESH_FRAME.replace('kind = "retreat"\ndistance_mm = 60', 'kind = "stop"')

#: name -> the scene, what is done with it, what must be loaded for it, what must not be
CASES: dict[str, tuple[str, str, set[str], set[str]]] = {
    "the package alone": ("", "import coneskin", {"coneskin"}, HEAVY | {"coneskin.geometry", "coneskin.skin"}),
    "errors and scene values": (
        "",
        "import coneskin.core.errors, coneskin.scene.values.scene",
        {"coneskin.scene.values.scene"},
        HEAVY | {"coneskin.geometry", "coneskin.skin", "coneskin.robot", "coneskin.scene.reader"},
    ),
    "a driver process": (
        "",
        "import coneskin.robot.ur.driver_process",
        {"coneskin.robot.ur.ur_rtde"},
        HEAVY | {"dataclasses", "inspect", "coneskin.robot.arm.model", "coneskin.robot.guard", "coneskin.scene"},
    ),
    "design only: unroll": (
        "",
        "from coneskin.cli import main; main(['unroll', '--radius1-mm', '54', '--height-mm', '434'])",
        {"coneskin.geometry.frustum"},
        HEAVY | {"coneskin.skin", "coneskin.robot", "coneskin.scene.reader", "coneskin.design.sheets.sheet_design"},
    ),
    "one cylinder, read": (
        _SERIAL_FREE,
        _LOAD,
        {*LOADED},
        HEAVY
        | VIRTUAL
        | FIELD
        | CALIBRATION
        | {"coneskin.robot", "coneskin.skin.wire", "coneskin.skin.sources.serial_port"},
    ),
    "one cylinder, guarded without an arm": (
        _NO_TOUCH,
        _BUILD,
        {*LOADED, "coneskin.skin.detection.stream"},
        HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.session.session", "coneskin.robot.ur.ur_rtde", "coneskin.robot.arm.kinematics"},
    ),
    "double cone, its touches scripted": (
        DOUBLE_CONE,
        _BUILD,
        {*LOADED, "coneskin.robot.arm.kinematics", "coneskin.skin.virtual.scripted_touch"},
        HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.session.session", "coneskin.skin.sources.serial_port", "coneskin.robot.ur.ur_rtde"},
    ),
    "no body": (_STOP, _LOAD, {*LOADED}, HEAVY | {"coneskin.skin.materials"}),
    "bodies, which no guard knows of": (
        _STOP + '[[body]]\nkind = "post"\nxyz_mm = [0, 0, 0]\ndirection = [0, 0, 1]\n[padding]\n',
        _BUILD,
        {*LOADED, "coneskin.skin.materials"},
        HEAVY | VIRTUAL | FIELD | SIMULATOR,
    ),
    "no mesh": (
        _NO_MESH_FRAME,
        _BUILD_COMMISSIONED,
        {*LOADED, *KINEMATICS},
        HEAVY | VIRTUAL | FIELD | SIMULATOR | {"coneskin.geometry.mesh", "coneskin.geometry.ray_casting"},
    ),
    "stop": (
        _STOP,
        _BUILD,
        {*LOADED, "coneskin.robot.arm.kinematics", "coneskin.robot.reaction.types"},
        {"coneskin.robot.arm.damped_least_squares"}
        | HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.robot.arm.inverse_kinematics", "coneskin.robot.ur.ur_rtde"},
    ),
    "a scene is only looked at": (
        SERIAL_RETREAT,
        "from coneskin.cli import main; main(['doctor', {scene!r}, '--check'])",
        {*LOADED},
        HEAVY
        | VIRTUAL
        | FIELD
        | CALIBRATION
        | SIMULATOR
        | {"coneskin.session.session", "coneskin.skin.detection.stream", "coneskin.robot.guard.core"},
    ),
    "replay": (
        "",
        "from coneskin.cli import main; assert main(['replay', {run!r}]) == 0",
        {*LOADED, "coneskin.runs.replay.run", "coneskin.robot.guard.core"},
        HEAVY
        | FIELD
        | SIMULATOR
        | {
            "coneskin.session.session",
            "coneskin.skin.sources.serial_port",
            "coneskin.runs.replay.run_picture",
            "coneskin.robot.ur.ur_rtde",
        },
    ),
    "a simulated arm that meets nothing": (
        _STOP.replace("192.168.1.10", "127.83.12.7"),
        _LOAD + "; from coneskin.commands.simulated_arm import simulated_arm; simulated_arm(scene, True).__enter__()",
        {"coneskin.robot.sim.process"},
        HEAVY | VIRTUAL | FIELD,
    ),
    "the process of the simulated arm": (
        "",
        "import coneskin.robot.sim.command",
        {"coneskin.robot.sim.machine.controller", "coneskin.robot.sim.motion.plant"},
        HEAVY | VIRTUAL | FIELD,
    ),
    "the driver of ur_rtde": (
        "",
        "import coneskin.robot.ur.driver_process",
        {"coneskin.robot.ur.driver_process"},
        HEAVY | {"coneskin.skin", "coneskin.geometry.mesh", "coneskin.robot.guard.core"},
    ),
    "the process of the guard": (
        "",
        "import coneskin.session.guard_process",
        {"coneskin.session.guard_process"},
        HEAVY
        | VIRTUAL
        | FIELD
        | CALIBRATION
        | SIMULATOR
        | {
            "coneskin.robot.ur.stop_sockets",
            "coneskin.robot.guard.motion.setpoint_stream",
            "coneskin.robot.ur.rtde_codec",
            "coneskin.robot.ur.input_writers",
            "coneskin.robot.ur.rtde_connection",
        },
    ),
}


@pytest.fixture(scope="module")
def a_run(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("run") / "run.rec"
    record(path)
    return str(path)


@pytest.mark.parametrize("case", CASES)
def test_what_is_not_named_is_not_loaded(case: str, tmp_path: Path, a_run: str) -> None:
    text, code, needed, unneeded = CASES[case]
    loaded = modules(text, code, tmp_path / "scene.toml", a_run)
    assert needed <= loaded
    assert not known(unneeded) & loaded


def test_a_scene_without_an_arm_loads_no_kinematics_and_no_reaction(tmp_path: Path) -> None:
    unneeded = {"arm.models", "reaction.retreat", "guard.arm_supervisor", "ur.rtde_connection"}
    unneeded |= {"arm.kinematics", "ur.rtde_codec"}
    assert not known({f"coneskin.robot.{name}" for name in unneeded}) & modules(
        _NO_TOUCH, _BUILD, tmp_path / "scene.toml", ""
    )


@pytest.mark.parametrize("scene", [_STOP, _NO_MESH_FRAME], ids=["a stop", "a retreat without a commissioning"])
def test_a_reaction_that_only_stops_loads_no_retreat(scene: str, tmp_path: Path) -> None:
    unneeded = {"guard.motion.setpoint_stream", "reaction.motion_choice", "reaction.retreat"}
    unneeded |= {"arm.workspace", "ur.input_writers"}
    loaded = modules(scene, _BUILD, tmp_path / "scene.toml", "")
    assert not known({f"coneskin.robot.{name}" for name in unneeded}) & loaded


def known(names: set[str]) -> set[str]:
    """The names; none of ours is that of a module which has been moved away."""
    assert not [name for name in names if name.startswith("coneskin") and find_spec(name) is None]
    return names


def modules(text: str, code: str, scene: Path, run: str) -> set[str]:
    """What is in sys.modules of a new interpreter after the code has run."""
    scene.write_text(text)
    code = code.format(scene=str(scene), run=run) + "; import sys; print('LOADED', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split("LOADED", 1)[1].split())
