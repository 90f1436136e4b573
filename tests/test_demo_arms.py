"""Arms of other makers, as packages: each keeps the contract, and is installed, guarded, stopped and replayed."""

import contextlib
import math
import os
import random
import shutil
import socket
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest

from coneskin.core.recording.reader import read_recording
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import load_driver
from coneskin.robot.guard.signals.journal import BlockKind, EventName, decode_event
from coneskin.robot.sim.process import free_host
from coneskin.testing.arm_contract import ARM_CHECKS, ArmOnTest
from tests.support.paths import ROOT

DEMOS = ROOT / "demos" / "arms"
PATIENT = """
[monitoring]
skin_silence_ms = 1000
arm_silence_ms = 1000
program_silence_ms = 1500
escalate_ms = 250
"""
#: where a busy computer has not put the arm under guard before the touch of the scene
LATER = "".join(
    f"[[source.touch]]\nstart_s = {at}\nend_s = {at}.6\nu_mm = 100\nphi_deg = 90\nforce_n = 10\n" for at in (8, 24, 72)
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder in which both packages are installed, as pip does it."""
    pytest.importorskip("mujoco")
    folder = tmp_path_factory.mktemp("site")
    # pip builds in them, and another process of the tests may do so at the same time
    copies = tmp_path_factory.mktemp("copies")
    packages = [shutil.copytree(DEMOS / name, copies / name) for name in ("seven_joints", "xarm")]
    words = ["install", "-q", "--no-deps", "--no-build-isolation", "--no-index", "--target", str(folder)]
    subprocess.run([sys.executable, "-m", "pip", *words, *packages], check=True, timeout=300)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        paths = (str(folder), str(ROOT / "src"), os.environ.get("PYTHONPATH", ""))
        patch.setenv("PYTHONPATH", os.pathsep.join(paths))
        yield folder


def test_the_drivers_are_as_long_as_the_page_says():
    drivers = sorted(DEMOS.glob("*/*/driver.py"))
    lines = [len(path.read_text().splitlines()) for path in drivers]
    assert max(lines) <= 150
    page = (ROOT / "docs" / "extend" / "arm.md").read_text()
    assert f"Their drivers have {lines[0]} and {lines[1]} lines" in page


@contextlib.contextmanager
def simulated(module, *options):
    """The controller of an arm in a process of its own, at an address of its own: the address and what kills it."""
    host = free_host()
    command = [sys.executable, "-m", module, "--host", host, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == f"ready at {host}\n"

            def kill():
                process.kill()
                process.wait()

            yield host, kill
        finally:
            process.kill()


@contextlib.contextmanager
def open_seven():
    model = arm_model("Seven")
    ask = import_module("coneskin_seven.driver").ask
    with simulated("coneskin_seven.simulation") as (host, kill):
        move = "speeds 0.3 0 0 0 0 0 0.4 4"  # the first and the seventh joint
        yield ArmOnTest(load_driver(model.driver), model, host, lambda: ask(host, move, 20.0), kill)


@pytest.mark.long
@pytest.mark.parametrize("check", ARM_CHECKS, ids=lambda check: check.__name__)
def test_the_driver_of_seven_joints_keeps_the_contract(site, check):
    check(open_seven)


@contextlib.contextmanager
def turning(host):
    """A program of the maker's own client, which turns a joint of an xArm until the controller is stopped."""
    command = [sys.executable, "-m", "coneskin_xarm.program", host]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            assert program.stdout is not None
            assert "moving\n" in iter(program.stdout.readline, "")
            yield program
        finally:
            program.kill()


@contextlib.contextmanager
def open_xarm():
    model = arm_model("xArm6")
    with simulated("coneskin_xarm.simulation") as (host, kill), contextlib.ExitStack() as stack:
        yield ArmOnTest(load_driver(model.driver), model, host, lambda: stack.enter_context(turning(host)), kill)


@pytest.fixture
def xarm():
    """Skip where the maker's client is not installed, or a program may not listen on its port 502."""
    pytest.importorskip("xarm")
    try:
        socket.create_server((free_host(), 502)).close()
    except PermissionError:
        pytest.skip("port 502 needs root here")


@pytest.mark.long
@pytest.mark.parametrize("check", ARM_CHECKS, ids=lambda check: check.__name__)
def test_the_driver_of_an_xarm_keeps_the_contract(site, xarm, check):
    check(open_xarm)


#: origins of the joints in the maker's URDF (xarm6.urdf.xacro of xarm_description): turn about x [rad], and place [m]
XARM6_URDF = (
    (0.0, (0.0, 0.0, 0.267)),
    (-math.pi / 2.0, (0.0, 0.0, 0.0)),
    (0.0, (0.0535, -0.2845, 0.0)),
    (-math.pi / 2.0, (0.0775, 0.3425, 0.0)),
    (math.pi / 2.0, (0.0, 0.0, 0.0)),
    (-math.pi / 2.0, (0.076, 0.097, 0.0)),
)


@pytest.mark.long
def test_the_table_of_the_xarm_is_that_of_its_maker_s_urdf(site, xarm):
    draw = random.Random(7)
    for _ in range(50):
        q = [draw.uniform(-3.0, 3.0) for _ in range(6)]
        pose = Pose()
        for (roll, place), angle in zip(XARM6_URDF, q, strict=True):
            pose = pose @ Pose.from_xyz_rpy(place, (roll, 0.0, 0.0)) @ Pose.from_xyz_rpy((0.0,) * 3, (0.0, 0.0, angle))
        ours = forward(arm_model("xArm6"), q)
        assert ours.translation == pytest.approx(pose.translation, abs=1e-9)
        assert np.array(ours.rotation) == pytest.approx(np.array(pose.rotation), abs=1e-9)


def guarded(folder, arm, host):
    """Guard an arm by the command until its first collision, and return the events of the run."""
    text = (DEMOS / arm / "scene.toml").read_text().replace("127.0.0.1", host) + PATIENT + LATER
    text = text.replace('kind = "virtual"', 'kind = "virtual"\nrate_hz = 200')
    (folder / "scene.toml").write_text(text)
    command = [sys.executable, "-m", "coneskin"]
    guard = [*command, "guard", "scene.toml", "--once"]
    found = subprocess.run(guard, cwd=folder, capture_output=True, text=True, timeout=300)
    assert found.returncode == 3, found.stdout + found.stderr
    (run,) = (folder / "runs").iterdir()
    replay = subprocess.run([*command, "replay", run], cwd=folder, capture_output=True, text=True, timeout=300)
    assert replay.returncode == 0, replay.stdout + replay.stderr
    assert "the events are the same, bit by bit" in replay.stdout
    return [decode_event(block) for block in read_recording(run / "run.rec") if block.kind == BlockKind.EVENT]


@pytest.mark.long
def test_seven_joints_are_guarded_stopped_and_replayed(site, tmp_path):
    with simulated("coneskin_seven.simulation", "--swing") as (host, _):
        events = guarded(tmp_path, "seven_joints", host)
    names = [event.name for event in events]
    order = [EventName.ACTIVATED, EventName.STOPPING, EventName.DECELERATING, EventName.STANDSTILL, EventName.LATCHED]
    assert [name for name in names if name in order] == order
    details = {event.name: event.details for event in events}
    assert details[EventName.STOPPING]["why"] == "touch"
    assert EventName.STANDSTILL in details, events
    assert details[EventName.STANDSTILL]["paths"] == ["command"]
    assert details[EventName.STANDSTILL]["speed"] < 0.05 < details[EventName.DECELERATING]["speed"]


@pytest.mark.long
def test_an_xarm_that_its_maker_s_client_moves_is_guarded_stopped_and_replayed(site, xarm, tmp_path):
    with simulated("coneskin_xarm.simulation") as (host, _), turning(host) as program:
        events = guarded(tmp_path, "xarm", host)
        assert "stopped by another\n" in iter(program.stdout.readline, "")
    details = {event.name: event.details for event in events}
    assert details[EventName.STOPPING]["why"] == "touch"
    assert EventName.STANDSTILL in details, events
    assert details[EventName.STANDSTILL]["paths"] == ["command"]
    assert details[EventName.STANDSTILL]["speed"] < 0.05 < details[EventName.DECELERATING]["speed"]
