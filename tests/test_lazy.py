"""What a scene leaves out is not imported: each case in a fresh interpreter, judged by sys.modules."""

import subprocess
import sys
from pathlib import Path

import pytest

from .scene.scenes import DOUBLE_CONE, SERIAL_RETREAT, SKIN_ONLY, record

NUMERIC = {"numpy", "scipy"}
DEVICES = {"serial", "rtde_control", "rtde_receive", "rtde_io", "dashboard_client"}
DRAWING = {"trimesh", "matplotlib", "ezdxf", "collada", "embreex", "tomli_w"}
HEAVY = NUMERIC | DEVICES | DRAWING
VIRTUAL = {"coneskin.skin.virtual", "coneskin.skin.circuit", "coneskin.skin.ladder", "coneskin.skin.pseudo_terminal"}
FIELD = {f"coneskin.skin.field_{name}" for name in ("model", "sheet", "contact", "places")}
KINEMATICS = {"coneskin.robot.link_frames", "coneskin.robot.compiled"}
SIMULATOR = {"coneskin.robot.sim_controller", "coneskin.robot.sim_process", "coneskin.robot.sim_server"}
LOADED = "coneskin.geometry.frustum", "coneskin.skin.sensor"

_LOAD = "from coneskin.scene import load; scene = load({scene!r})"
_BUILD = _LOAD + "; from coneskin.build import build_core; build_core(scene)"
_SERIAL_FREE = SKIN_ONLY[: SKIN_ONLY.index("[source]")]
_NO_TOUCH = SKIN_ONLY[: SKIN_ONLY.index("[[source.touch]]")]
_NO_MESH_FRAME = SERIAL_RETREAT.replace('name = "upper_arm"', 'name = "upper_arm"\nframe = "dh"')
_STOP = _NO_MESH_FRAME.replace('kind = "retreat"\ndistance_mm = 60', 'kind = "stop"')

#: name -> the scene, what is done with it, what must be loaded for it, what must not be
CASES: dict[str, tuple[str, str, set[str], set[str]]] = {
    "the package alone": ("", "import coneskin", {"coneskin"}, HEAVY | {"coneskin.geometry", "coneskin.skin"}),
    "errors and scene values": (
        "",
        "import coneskin.errors, coneskin.scene",
        {"coneskin.scene"},
        HEAVY | {"coneskin.geometry", "coneskin.skin", "coneskin.robot", "coneskin.scene_reader"},
    ),
    "design only: unroll": (
        "",
        "from coneskin.cli import main; main(['unroll', '--radius1-mm', '54', '--height-mm', '434'])",
        {"coneskin.geometry.sector"},
        HEAVY | {"coneskin.skin", "coneskin.robot", "coneskin.scene_reader", "coneskin.design"},
    ),
    "one cylinder, read": (
        _SERIAL_FREE,
        _LOAD,
        {*LOADED},
        HEAVY | VIRTUAL | FIELD | {"coneskin.robot", "coneskin.skin.wire", "coneskin.skin.serial_port"},
    ),
    "one cylinder, guarded without an arm": (
        _NO_TOUCH,
        _BUILD,
        {*LOADED, "coneskin.skin.stream"},
        HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.session", "coneskin.robot.ur_rtde", "coneskin.robot.link_frames"},
    ),
    "double cone, its touches scripted": (
        DOUBLE_CONE,
        _BUILD,
        {*LOADED, "coneskin.robot.link_frames", "coneskin.skin.scripted_touch"},
        HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.session", "coneskin.skin.serial_port", "coneskin.robot.ur_rtde"},
    ),
    "no mesh": (
        _NO_MESH_FRAME,
        _BUILD,
        {*LOADED, *KINEMATICS},
        HEAVY | VIRTUAL | FIELD | SIMULATOR | {"coneskin.geometry.mesh", "coneskin.geometry.rays"},
    ),
    "stop": (
        _STOP,
        _BUILD,
        {*LOADED, "coneskin.robot.link_frames", "coneskin.robot.commands"},
        {"coneskin.robot.compiled"}
        | HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {"coneskin.robot.inverse", "coneskin.robot.ur_rtde"},
    ),
    "a scene is only looked at": (
        SERIAL_RETREAT,
        "from coneskin.cli import main; main(['guard', {scene!r}, '--check'])",
        {*LOADED},
        HEAVY | VIRTUAL | FIELD | SIMULATOR | {"coneskin.session", "coneskin.skin.stream", "coneskin.robot.guard_core"},
    ),
    "replay": (
        "",
        "from coneskin.cli import main; assert main(['replay', {run!r}]) == 0",
        {*LOADED, "coneskin.replay", "coneskin.robot.guard_core"},
        HEAVY
        | FIELD
        | SIMULATOR
        | {"coneskin.session", "coneskin.skin.serial_port", "coneskin.run_picture", "coneskin.robot.ur_rtde"},
    ),
    "the owner of ur_rtde": (
        "",
        "import coneskin.robot.owner",
        {"coneskin.robot.owner"},
        HEAVY | {"coneskin.skin", "coneskin.geometry.mesh", "coneskin.robot.guard_core"},
    ),
    "the process of the guard": (
        "",
        "import coneskin.guard_process",
        {"coneskin.guard_process"},
        HEAVY
        | VIRTUAL
        | FIELD
        | SIMULATOR
        | {f"coneskin.robot.{name}" for name in ("foreign", "mover", "rtde_codec", "speed_slider", "state_reader")},
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
    assert not unneeded & loaded


def test_a_scene_without_an_arm_loads_no_kinematics_and_no_reaction(tmp_path: Path) -> None:
    unneeded = {"ur_models", "retreat", "arm_reaction", "state_reader", "compiled", "rtde_codec"}
    assert not {f"coneskin.robot.{name}" for name in unneeded} & modules(_NO_TOUCH, _BUILD, tmp_path / "scene.toml", "")


def test_a_reaction_that_only_stops_loads_no_retreat(tmp_path: Path) -> None:
    unneeded = {"mover", "leaving", "movement", "retreat", "comply", "trail", "table", "follower", "steering"}
    loaded = modules(_STOP, _BUILD, tmp_path / "scene.toml", "")
    assert not {f"coneskin.robot.{name}" for name in unneeded} & loaded


def modules(text: str, code: str, scene: Path, run: str) -> set[str]:
    """What is in sys.modules of a new interpreter after the code has run."""
    scene.write_text(text)
    code = code.format(scene=str(scene), run=run) + "; import sys; print('LOADED', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split("LOADED", 1)[1].split())
