"""Start and end of child processes: they get their ends, nothing else, and do not outlive their parent."""

import contextlib
import os
import select
import signal
import subprocess
import sys
import threading

import pytest

from coneskin.core import child_process as module
from coneskin.core.channel import Channel, encode_json, pair, wait_readable
from coneskin.core.child_process import Lifeline, spawn
from coneskin.core.errors import RobotConnectionError
from tests.support.scenes import forearm_scene


def test_a_child_gets_its_end(tmp_path, monkeypatch):
    (tmp_path / "echo_child.py").write_text(
        "import select, sys\n"
        "from coneskin.core.child_process import inherit\n"
        "lifeline, (c,) = inherit(sys.argv[1:])\n"
        "lifeline.hold()\n"
        "while not c.closed:\n"
        "    select.select([c], [], [], 1)\n"
        "    for m in c.receive(): c.send(m[::-1])\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    a, b = pair()
    child = spawn("echo_child", b)
    ours = Channel(a)
    ours.send(b"abc")
    assert wait_readable([ours], 60.0)
    assert ours.receive() == [b"cba"]
    ours.close()
    assert child.wait(60) == 0


def test_a_child_that_cannot_start_is_said(monkeypatch):
    monkeypatch.setattr(module.sys, "executable", "/nowhere/python")
    a, b = pair()
    with pytest.raises(RobotConnectionError, match=r"cannot start the process x: No such file"):
        spawn("x", b)
    a.close()
    b.close()
    assert sys.executable == "/nowhere/python"


@pytest.mark.promise("P68")
@pytest.mark.long
def test_a_limit_of_memory_under_which_a_child_would_end_is_said(monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (300 * 2**20, -1))
    with pytest.raises(RobotConnectionError, match=r"300 MB .* 400 MB: raise the limit \(ulimit -v\)"):
        spawn("coneskin.nothing")


def test_a_child_imports_nothing_from_the_current_folder(tmp_path, monkeypatch):
    for name in ("json", "serial", "socket"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').write('{name}')")
    monkeypatch.chdir(tmp_path)
    a, b = pair()
    child = spawn("coneskin.session.skin_process", b)
    ours = Channel(a)
    ours.send(encode_json({"scene": forearm_scene(), "name": "scene.toml", "folder": str(tmp_path)}))
    assert wait_readable([ours], 60.0)
    assert b"port" in ours.receive()[0]  # it has imported everything
    ours.close()
    assert child.wait(60) == 1
    assert not (tmp_path / "ran").exists()


# ---- a parent that is gone


def start_parent(said, tmp_path):
    """Start a parent that starts a child, tells it this, and forks below Python; it prints both numbers."""
    (tmp_path / "waiting_child.py").write_text(
        "import sys, time\n"
        "from coneskin.core.channel import wait_readable\n"
        "from coneskin.core.child_process import inherit\n"
        "lifeline, (c,) = inherit(sys.argv[1:])\n"
        "while not (said := c.receive()): wait_readable([c], 20.0)\n"
        "if said == [b'hold']: lifeline.hold()\n"
        "c.send(b'ready')\n"
        "while said == [b'hold'] and not c.closed:\n"
        "    wait_readable([c], 60.0)\n"
        "    c.receive()\n"
        "if said == [b'start']: time.sleep(600.0)\n"  # an import, or a library that connects
    )
    code = (
        "import ctypes, time\n"
        "from coneskin.core.channel import Channel, pair, wait_readable\n"
        "from coneskin.core.child_process import spawn\n"
        "a, b = pair()\n"
        "child = spawn('waiting_child', b)\n"
        "ours = Channel(a)\n"
        f"ours.send({said!r})\n"
        "wait_readable([ours], 60.0)\n"
        "copy = ctypes.CDLL(None).fork()\n"  # nothing of ours runs in it
        "while copy == 0: time.sleep(600.0)\n"
        "print(child.pid, copy, flush=True)\n"
        "child.wait()\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)


def ends_in_time(number):
    """Tell whether a process that is not our child ends within 10 s."""
    try:
        descriptor = os.pidfd_open(number)
    except ProcessLookupError:
        return True
    try:
        return bool(select.select([descriptor], [], [], 10.0)[0])
    finally:
        os.close(descriptor)


@pytest.mark.promise("P49")
@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="only Linux has descriptors of processes")
@pytest.mark.parametrize("said", [b"hold", b"start"])
def test_a_child_notices_the_end_of_its_parent_though_a_fork_below_python_has_copies(said, tmp_path):
    parent = start_parent(said, tmp_path)
    child, copy = map(int, parent.stdout.readline().split())
    parent.kill()
    parent.wait()
    parent.stdout.close()
    try:
        assert ends_in_time(child)
    finally:
        for number in (child, copy):
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no poll")
def test_a_child_that_starts_ends_with_the_channel_and_one_that_works_looks_for_itself():
    ended, over = [], threading.Event()
    ours, theirs = map(Channel, pair())
    Lifeline(theirs, None, lambda: (ended.append("at the start"), over.set()))
    ours.close()
    assert over.wait(60.0)
    theirs.close()
    ours, theirs = map(Channel, pair())
    working = Lifeline(theirs, None, lambda: ended.append("at work"))
    working.hold()
    ours.close()
    working._thread.join(60.0)
    assert not working._thread.is_alive()
    assert ended == ["at the start"]
    theirs.close()


@pytest.mark.skipif(sys.platform == "win32", reason="written for sockets that end in both directions")
def test_what_was_said_before_the_parent_ended_is_still_received():
    ours, theirs = map(Channel, pair())
    ours.send(b"the last word")
    theirs.hang_up()
    assert theirs.receive() == [b"the last word"]
    assert theirs.receive() == []
    assert theirs.closed
    ours.close()
    theirs.close()
