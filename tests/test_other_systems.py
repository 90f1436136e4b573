"""Imitations of Windows and macOS on Linux: what can be imported and run where their parts of POSIX are missing.

They are no tests on those systems, which CI has: only the name of the system is changed, and what it lacks is taken
away. The standard library and the packages below are loaded before, as those of this system.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.sweep import sweep

IMITATION = """
import asyncio, concurrent.futures.process, importlib.metadata, logging.handlers, multiprocessing.context, os, select
import shutil, signal, socket, subprocess, sys, tempfile, threading, urllib.request, zipfile
import numpy, scipy.spatial, serial, trimesh

lacking = {{
    "win32": {{
        os: "fork openpty uname sched_setaffinity sched_setscheduler getuid nice pidfd_open posix_spawn killpg mkfifo",
        signal: "SIGKILL SIGSTOP SIGCONT SIGHUP SIGALRM pthread_sigmask setitimer",
        select: "poll epoll",
        socket: "AF_UNIX send_fds recv_fds",
    }},
    "darwin": {{os: "sched_setaffinity sched_setscheduler pidfd_open", select: "epoll"}},
}}
sys.platform = {system!r}
for module, names in lacking[sys.platform].items():
    for name in names.split():
        module.__dict__.pop(name, None)
if sys.platform == "win32":
    for name in ("fcntl", "termios", "tty", "pty", "resource", "pwd", "grp"):
        sys.modules[name] = None
"""


def imitate(system: str, code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run Python as it would look there."""
    words = [sys.executable, "-c", IMITATION.format(system=system) + code]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=180)


def command(*words: str) -> str:
    """Code that runs a command of coneskin."""
    return f"from coneskin.cli import main; sys.exit(main({list(words)!r}))"


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="imitates other systems on Linux")
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_every_module_is_imported(system: str, tmp_path: Path) -> None:
    """None needs a module at its top that these systems do not have."""
    names = sorted(
        ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__")
        for path in (ROOT / "src" / "coneskin").glob("**/*.py")
        if path.name != "__main__.py"
    )
    for folder in ("geometry", "skin", "robot"):
        names += [
            "coneskin." + ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            for path in (ROOT / folder).rglob("*.py")
        ]
    code = f"""
import importlib, json
broken = {{}}
for name in {sorted(set(names))!r}:
    try:
        importlib.import_module(name)
    except Exception as error:
        broken[name] = f"{{type(error).__name__}}: {{error}}"
print(json.dumps(broken))
"""
    done = imitate(system, code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {}
    assert len(set(names)) > 300


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="imitates other systems on Linux")
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_a_run_is_replayed_and_a_link_unrolled(system: str, tmp_path: Path) -> None:
    done = imitate(system, command("replay", "gallery:hand"), tmp_path)
    assert (done.returncode, "the same, bit by bit" in done.stdout) == (0, True), done.stderr
    done = imitate(
        system, command("unroll", "--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150"), tmp_path
    )
    assert (done.returncode, "203.960781 mm" in done.stdout) == (0, True), done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="imitates other systems on Linux")
@pytest.mark.parametrize(("system", "said"), sweep([("win32", "COM3"), ("darwin", "/dev/cu.usbserial-1")]))
@pytest.mark.long
def test_a_scene_is_checked(system: str, said: str, tmp_path: Path) -> None:
    scene = f"""
[[link]]
name = "tube"
[[link.sensor]]
radius1_mm = 54
radius2_mm = 54
height_mm = 300
[source]
kind = "serial"
port = "{said}"
"""
    (tmp_path / "scene.toml").write_text(scene)
    done = imitate(system, command("doctor", "scene.toml", "--check"), tmp_path)
    assert "Traceback" not in done.stderr
    assert said in done.stdout, done.stderr


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="imitates other systems on Linux")
def test_what_needs_a_pseudo_terminal_is_refused_on_windows_with_a_remedy(tmp_path: Path) -> None:
    code = "from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal; open_raw_terminal()"
    done = imitate("win32", code, tmp_path)
    assert done.returncode == 1
    assert "which Windows does not have; use the skin in memory, or a pair of ports made by com0com" in done.stderr
