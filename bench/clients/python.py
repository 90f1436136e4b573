"""Trials of bench `ur-clients` with Python clients: Universal Robots' RTDE client and python-urx."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

from .urcl import TEST_TIMEOUT, Trial, controller

#: program that loads and plays the client's own program
_PLAY_PROGRAM = """
import socket
with socket.create_connection(({host!r}, 29999), 5.0) as sock:
    file = sock.makefile("rw")
    print(file.readline())
    for line, reply in (("load rtde_control_loop.urp", "Loading program"), ("play", "Starting program")):
        file.write(line + "\\n")
        file.flush()
        assert reply in file.readline()
"""

#: URScript of the client's rtde_control_loop.urp, which PolyScope would write beside it
_CONTROL_LOOP = """
def rtde_control_loop():
  global setp = p[0, 0, 0, 0, 0, 0]
  rtde_set_watchdog("input_int_register_0", 1, "PAUSE")
  write_output_integer_register(0, 1)
  thread watch_setp():
    while True:
      global tmp = p[0, 0, 0, 0, 0, 0]
      i = 0
      while i < 6:
        tmp[i] = read_input_float_register(i)
        i = i + 1
      end
      global setp = tmp
      sync()
    end
  end
  run watch_setp()
  while True:
    if read_input_integer_register(0) == 1 and setp != p[0, 0, 0, 0, 0, 0]:
      movel(setp, a=1.2, v=0.08)
      write_output_integer_register(0, 0)
      while read_input_integer_register(0) == 1:
        sync()
      end
      write_output_integer_register(0, 1)
    end
    sync()
  end
end
"""


def _run(label: str, test: str, command: Sequence[str], folder: Path, timeout: float = TEST_TIMEOUT) -> Trial:
    begin = time.monotonic()
    environment = os.environ | {"MPLBACKEND": "agg"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=timeout, check=False
        )
        problem = "" if done.returncode == 0 else (done.stderr or done.stdout)[-300:]
    except subprocess.TimeoutExpired as exc:
        problem = f"it took more than {timeout:g} s; {exc.stderr or exc.stdout!r}"[-300:]
    trial = Trial(label, test, "fail" if problem else "pass", time.monotonic() - begin, problem)
    print(f"{trial.result:5} {trial.seconds:6.1f} {label} {test} {trial.why[:200]}", file=sys.stderr, flush=True)
    return trial


def rtde_client(source: Path) -> Iterator[Trial]:
    """Run the examples of Universal Robots' RTDE client: recording, text and binary, and the control loop."""
    label = "official RTDE client"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(source, folder / "client", ignore=shutil.ignore_patterns(".git"))
        examples = folder / "client" / "examples"
        with controller() as simulated:
            record = [sys.executable, "record.py", "--host", simulated.host, "--samples", "500", "--frequency", "500"]
            yield _run(label, "record.py", record, examples)
            yield _run(label, "record.py --binary", [*record, "--binary", "--output", "b.csv"], examples)
            if find_spec("matplotlib") is not None:
                yield _run(label, "example_plotting.py", [sys.executable, "example_plotting.py"], examples)
        programs = folder / "programs"
        programs.mkdir()
        shutil.copy(examples / "rtde_control_loop.urp", programs)
        (programs / "rtde_control_loop.script").write_text(_CONTROL_LOOP)
        with controller(programs=programs) as simulated:
            loop = examples / "example_control_loop.py"
            text = loop.read_text().replace('"localhost"', repr(simulated.host))
            # it goes on for ever: end it after it has moved twice
            text = text.replace(
                "move_completed = True\n        watch", "move_completed = True\n        moves += 1\n        watch"
            )
            text = text.replace("keep_running = True", "keep_running = True\nmoves = 0", 1)
            loop.write_text(text.replace("while keep_running:", "while moves < 2:"))
            (examples / "play.py").write_text(_PLAY_PROGRAM.format(host=simulated.host))
            # the program watches for its client: that comes first
            command = f"{sys.executable} {loop.name} & sleep 3; {sys.executable} play.py && wait %1"
            yield _run(label, "example_control_loop.py", ["bash", "-c", command], examples)


#: part of python-urx's own examples that asks for no person: what each does, as a line of its class
_URX_TRIALS = {
    "positions and pose": "print(rob.getj(), rob.getl(), rob.get_pose())",
    "movej": "rob.movej((0.1, -1.4, 1.4, -1.5, -1.5, 0), acc=1.0, vel=1.0)",
    "simple.py": (
        "l = 0.05; pose = rob.getl(); pose[2] += l; rob.movel(pose, acc=0.3, vel=0.05); "
        "rob.translate((0, 0, -l), acc=0.3, vel=0.05); rob.translate_tool((0, 0, -l), acc=0.3, vel=0.05); "
        "rob.translate_tool((0, 0, l), acc=0.3, vel=0.05)"
    ),
    "movels with radius": (
        "p = rob.getl(); a = p[:]; a[0] -= 0.05; b = a[:]; b[2] -= 0.05; "
        "rob.movels([a, b], acc=0.3, vel=0.1, radius=0.01)"
    ),
    "movec": (
        "p = rob.get_pose(); v = p.copy(); v.pos[0] += 0.05; t = v.copy(); t.pos[1] += 0.05; "
        "rob.movec(v, t, acc=0.3, vel=0.05)"
    ),
    "speedl_tool and stopj": (
        "import time; rob.speedl_tool((0, 0, -0.05, 0, 0, 0), acc=0.3, min_time=1); time.sleep(0.5); rob.stopj()"
    ),
    "digital and analog": "rob.set_digital_out(0, True); print(rob.get_digital_out(0), rob.get_analog_inputs())",
    "realtime monitor": "print(rob.rtmon.getTCF(True), rob.rtmon.q_actual(True))",
}


#: before python-urx is imported: names that Python has moved since, and numbers of numpy 2 as text that URScript knows
_URX_SHIM = """
import collections, collections.abc as c, numpy
collections.Iterable, collections.Sequence = c.Iterable, c.Sequence
if int(numpy.__version__.split(".")[0]) >= 2:
    numpy.set_printoptions(legacy="1.25")
"""


def urx(source: Path) -> Iterator[Trial]:
    """Run what python-urx's examples do, one by one; the packages beside its own may be in its folder too.

    Its realtime monitor is told the version of the software: without one its thread ends with an error of its own.
    """
    label = "python-urx"
    with tempfile.TemporaryDirectory() as folder:
        for test, line in _URX_TRIALS.items():
            body = "\n    ".join(part.strip() for part in line.split(";"))

            def attempt(test: str = test, body: str = body) -> Trial:
                with controller() as simulated:
                    text = (
                        f"import sys; sys.path[:0] = {[str(source), str(source / 'packages')]!r}\n{_URX_SHIM}\n"
                        f"import urx\nrob = urx.Robot({simulated.host!r}, use_rt=True, urFirm=5.9)\n"
                        f"rob.set_tcp((0,) * 6)\nrob.set_payload(0.5, (0, 0, 0))\n"
                        f"try:\n    {body}\nfinally:\n    rob.close()\n"
                    )
                    return _run(label, test, [sys.executable, "-c", text], Path(folder), 30.0)

            trial = attempt()
            if trial.result == "fail":
                again = attempt()
                if again.result != "fail":
                    trial = again._replace(why=f"on the second try; on the first: {trial.why}")
            yield trial
