"""What is built and installed: wheel, source distribution and editable install, each in an environment of its own.

pip fetches the dependencies of these environments, so these tests need a package index. What builds and checks types
is of the environment of the tests (``[dev]``).
"""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import coneskin
from tests.support.paths import COLLISION, ROOT

from .test_docs import PageRun, blocks

pytestmark = pytest.mark.long
pytest.importorskip("build", reason="needs pip install -e '.[dev]'")

FOLDERS = ("geometry", "skin", "robot")
USER = """\
from typing import assert_type

from coneskin.geometry.frustum import Frustum
from coneskin.robot.arm.kinematics import forward
from coneskin.skin.sensor import Sensor

cone = Frustum(0.04, 0.07, 0.15)
assert_type(cone.radius1, float)
Frustum("40", 0.07, 0.15)
"""


def run(*command: str | Path, cwd: Path, **variables: str) -> str:
    words, variables = [str(word) for word in command], {**os.environ, "PYTHONPATH": "", **variables}
    done = subprocess.run(words, cwd=cwd, env=variables, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def environment(path: Path, *packages: str | Path) -> Path:
    """Make an empty virtual environment with what pip makes of these words; return the folder of its programs."""
    run(sys.executable, "-m", "venv", "--without-pip", path, cwd=path.parent)
    programs = path / ("Scripts" if sys.platform == "win32" else "bin")
    run(sys.executable, "-m", "pip", "--python", programs / "python", "install", "-q", *packages, cwd=path.parent)
    return programs


def copy(path: Path) -> Path:
    """Copy the source tree, links as links, without what was built in it."""
    built = shutil.ignore_patterns(".*", "build", "dist", "*.egg-info", "__pycache__")

    def unwanted(folder: str, names: list[str]) -> set[str]:
        return built(folder, names) | ({"runs"} if Path(folder) == ROOT else set())  # recorded there by a demo

    return Path(shutil.copytree(ROOT, path, symlinks=True, ignore=unwanted))


def contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the source distribution and the wheel that was built from it, with what the project says it needs."""
    tree = copy(tmp_path_factory.mktemp("tree") / "coneskin")
    run(sys.executable, "-m", "build", "-q", cwd=tree)
    return tree / "dist"


@pytest.fixture(scope="module")
def wheel(built: Path) -> Path:
    (found,) = built.glob("*.whl")
    return found


def test_the_wheel_holds_every_module_and_nothing_else(wheel: Path) -> None:
    folders = {"coneskin": ROOT / "src" / "coneskin", **{f"coneskin/{name}": ROOT / name for name in FOLDERS}}
    expected = {
        f"{name}/{path.relative_to(folder).as_posix()}"
        for name, folder in folders.items()
        for pattern in (
            "*.py",
            "*.pyi",
            "py.typed",
            "*.json",
            "*.csv",
            "*.ino",
            "*.h",
            "*.c",
            "*.toml",
            "*.txt",
            "*.css",
            "*.js",
            "gallery/*.rec",
        )
        for path in folder.rglob(pattern)
    }
    found = {name for name in contents(wheel) if ".dist-info/" not in name}
    assert found == expected
    assert wheel.name == f"coneskin-{coneskin.__version__}-py3-none-any.whl"


@pytest.mark.parametrize("links", [True, False])
def test_the_tree_and_its_sdist_build_the_same_wheel(wheel: Path, tmp_path: Path, links: bool) -> None:
    """With the links of src/coneskin, and with the small files that a git without links makes of them."""
    tree = copy(tmp_path / "coneskin")
    if not links:
        for name in FOLDERS:
            link = tree / "src" / "coneskin" / name
            link.unlink()
            link.write_text(f"../../{name}", encoding="utf-8")
    run(sys.executable, "-m", "build", "-q", "--wheel", "--no-isolation", cwd=tree)
    (other,) = (tree / "dist").glob("*.whl")
    assert contents(other) == contents(wheel)


def test_the_sdist_holds_no_tests(built: Path) -> None:
    (found,) = built.glob("*.tar.gz")
    with tarfile.open(found) as archive:
        tops = {name.split("/")[1] for name in archive.getnames() if "/" in name}
    assert tops >= {"src", "pyproject.toml", "setup.py", "README.md", "LICENSE"}
    assert not tops & {"tests", "bench", "demos"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory, wheel: Path) -> Path:
    """Folder of the programs of an environment in which the wheel is, without any extra."""
    return environment(tmp_path_factory.mktemp("user") / "venv", wheel)


@pytest.mark.processes
def test_the_installed_wheel_runs_without_the_tree(installed: Path, tmp_path: Path) -> None:
    programs = installed
    assert run(programs / "coneskin", "--version", cwd=tmp_path) == f"coneskin {coneskin.__version__} (pure)\n"
    cone = ("--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150")
    assert "203.960781 mm" in run(programs / "coneskin", "unroll", *cone, cwd=tmp_path)  # as in demos/01_unroll.py
    assert "bit by bit" in run(programs / "coneskin", "replay", "gallery:palm", cwd=tmp_path)
    if sys.platform != "win32":  # the demo's virtual skin needs a pseudo-terminal
        assert "bit by bit" in run(programs / "coneskin", "demo", cwd=tmp_path)


@pytest.mark.processes
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere 127.0.0.1 is the only such address")
@pytest.mark.skipif(find_spec("rtde_control") is None, reason="the ur_rtde wheel is not installed")
def test_readmes_first_program_runs_from_the_wheel_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    program = next(block for block in blocks(ROOT / "README.md") if block.language == "python")
    (tmp_path / "program.py").write_text(PageRun(tmp_path).adapt(program.text), encoding="utf-8")
    said = run(installed / "python", "program.py", cwd=tmp_path)
    (u_mm,) = re.findall(r"on the forearm was touched at u = ([0-9.]+) mm", said)
    assert float(u_mm) == pytest.approx(130.0, abs=0.5)  # which samples of the noise it is of depends on the clock
    assert "same decisions, bit by bit: True" in said


@pytest.mark.processes
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere 127.0.0.1 is the only such address")
def test_the_simulated_controller_comes_up_without_any_extra(installed: Path, tmp_path: Path) -> None:
    """It answers on each of its ports, and none of the extras' packages is there."""
    extras = ["ezdxf", "matplotlib", "mujoco", "viser", "pyarrow"]
    code = f"import importlib.util as u; print([name for name in {extras} if u.find_spec(name)])"
    assert run(installed / "python", "-c", code, cwd=tmp_path) == "[]\n"
    command = [installed / "coneskin", "sim-ur", "--host", "127.0.77.3", "--json"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            facts = json.loads(process.stdout.readline())
            asked = {"RTDE": b"\0\5V\0\2", "interpreter": b"statelastexecuted\n"}  # protocol version 2; a command
            said = {}
            for name, port in facts["ports"].items():
                with socket.create_connection((facts["host"], port), 60.0) as sock:
                    sock.sendall(asked.get(name, b""))
                    said[name] = sock.recv(4)
        finally:
            process.terminate()
    assert process.returncode == 0
    assert said.pop("RTDE") == b"\0\4V\1"
    assert said.pop("dashboard") == b"Conn"
    states = ("primary", "secondary", "realtime")
    assert set(said) == {*states, *(f"{name} (read-only)" for name in states), "interpreter"}
    assert all(len(data) == 4 for data in said.values())


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_a_compiled_wheel_replays_what_pure_python_has_recorded(built: Path, tmp_path: Path) -> None:
    """Made from the source distribution: by ``make build/compiled/done``, or else here."""
    folder = Path(os.environ.get("COMPILED_WHEEL", tmp_path))
    if folder == tmp_path:
        (sdist,) = built.glob("*.tar.gz")
        words = ("-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", sdist)
        run(sys.executable, *words, cwd=folder, CONESKIN_COMPILE="1", CONESKIN_OPTIMIZE="0")
    (compiled,) = folder.glob("*.whl")
    assert "-none-any" not in compiled.name
    packages = tmp_path / "packages"
    run(sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", packages, compiled, cwd=tmp_path)
    there = {"cwd": tmp_path, "PYTHONPATH": str(packages)}
    said = run(sys.executable, "-m", "coneskin", "--version", **there)
    assert said == f"coneskin {coneskin.__version__} (compiled)\n"
    assert "the same, bit by bit" in run(sys.executable, "-m", "coneskin", "replay", COLLISION, **there)


def test_type_checkers_see_an_editable_install(tmp_path: Path) -> None:
    """As README installs it, and in a project of the user's elsewhere; only his mistake is reported."""
    tree = copy(tmp_path / "coneskin")
    if not all((tree / "src" / "coneskin" / name).is_symlink() for name in FOLDERS):
        pytest.skip("this checkout has no symbolic links: git config core.symlinks")
    programs = environment(tmp_path / "venv", "--no-deps", "-e", tree)
    project = tmp_path / "project"
    project.mkdir()
    (project / "program.py").write_text(USER, encoding="utf-8")
    words = ["-m", "mypy", "--strict", "--python-executable", programs / "python", "program.py"]
    done = subprocess.run([sys.executable, *words], cwd=project, capture_output=True, text=True, timeout=300)
    complaints = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert len(complaints) == 1, done.stdout + done.stderr
    assert complaints[0].startswith("program.py:9: error:")
    assert '"str"' in complaints[0]


def test_the_simulated_controller_is_a_distribution_of_its_own(tmp_path: Path) -> None:
    """From a source distribution into an empty environment, where a client and a user's pytest meet it."""
    tree = copy(tmp_path / "coneskin")
    needs = [
        tomllib.loads((tree / name / "pyproject.toml").read_text())["build-system"]
        for name in (".", "packaging/sim-ur")
    ]
    assert needs[0] == needs[1], "what is built alone above needs no more, and the build here makes no environment"
    run(sys.executable, "-m", "build", "-q", "--no-isolation", "packaging/sim-ur", cwd=tree)
    (found,) = (tmp_path / "coneskin" / "packaging" / "sim-ur" / "dist").glob("*.whl")
    assert len(found.read_bytes()) < 250_000
    assert not [name for name, text in contents(found).items() if b"coneskin" in text and "dist-info" not in name]
    programs = environment(tmp_path / "venv", "--no-index", found)
    listed = run(sys.executable, "-m", "pip", "--python", programs / "python", "list", "--format", "json", cwd=tmp_path)
    assert [package["name"] for package in json.loads(listed)] == ["sim-ur"]
    client = (
        "import socket, subprocess, sys\n"
        "from sim_ur import SimulatedController\n"
        "from sim_ur.robot.sim.process import free_host\n"
        "with SimulatedController('UR8 Long', free_host()) as controller:\n"
        "    with socket.create_connection((controller.host, 30004), timeout=60) as rtde:\n"
        "        rtde.sendall(bytes([0, 5, 86, 0, 2]))\n"
        "        assert rtde.recv(9) == bytes([0, 4, 86, 1])\n"
        "    assert controller.state()['safety'] == 'NORMAL'\n"
        "heavy = {'numpy', 'scipy', 'trimesh', 'rtde_control', 'coneskin'} & set(sys.modules)\n"
        "print('nothing else' if not heavy else heavy)\n"
    )
    assert run(programs / "python", "-c", client, cwd=tmp_path) == "nothing else\n"
    assert run(programs / "sim-ur", "--help", cwd=tmp_path).startswith("usage: sim-ur")
    run(sys.executable, "-m", "pip", "--python", programs / "python", "install", "-q", "pytest", cwd=tmp_path)
    (text,) = re.findall(r'title="test_mine.py"\n(.*?)```', (ROOT / "docs/do/ur-controller.md").read_text(), re.DOTALL)
    (tmp_path / "test_mine.py").write_text(text)
    assert "1 passed" in run(programs / "python", "-m", "pytest", "-q", "test_mine.py", cwd=tmp_path)
