"""Calls of the real ur_rtde wheel where they can do no harm: in a child process with a hard time limit.

The wheel can block for 301 s, abort, or crash the process, so no test may call it in its own. The calls are the
functions of `wheel_calls`; what they return comes back as JSON, and the child leaves without the wheel's destructors.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from typing import Any

from tests.support.paths import ROOT

_CHILD = (
    "import faulthandler, json, os, sys; faulthandler.dump_traceback_later(50.0); "
    "from tests.robot import wheel_calls as calls; "
    "result = getattr(calls, sys.argv[1])(*json.loads(sys.argv[2])); "
    "print(); print('RESULT ' + json.dumps(result), flush=True); os._exit(0)"
)


def start(call: str, *arguments: Any) -> subprocess.Popen[str]:
    """Begin a call; the caller talks to the process, and ends it."""
    return subprocess.Popen(
        [sys.executable, "-c", _CHILD, call, json.dumps(arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def run(call: str, *arguments: Any, limit: float = 60.0) -> Any:
    """Return the result of a function of `wheel_calls`; an AssertionError if it crashed or exceeded the limit [s]."""
    process = start(call, *arguments)
    try:
        said, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        process.kill()
        said, _ = process.communicate()
        raise AssertionError(f"{call} took longer than {limit} s; it said: {said}") from None
    assert process.returncode == 0, f"{call} ended with {process.returncode}; it said: {said}"
    return result(said)


def result(said: str) -> Any:
    """Read the result in what a call has printed; an AssertionError if there is none."""
    lines = [line for line in said.splitlines() if line.startswith("RESULT ")]
    assert lines, f"the call has no result; it said: {said}"
    return json.loads(lines[-1].removeprefix("RESULT "))


def wait_for(process: subprocess.Popen[str], word: str, limit: float = 30.0) -> None:
    """Read what a call prints up to a line with the word; an AssertionError if none comes within the limit [s]."""
    assert process.stdout is not None
    said = []
    killer = threading.Timer(limit, process.kill)  # which ends the lines below
    killer.start()
    try:
        for line in process.stdout:
            if word in line:  # the wheel may print into the same line
                return
            said.append(line)
    finally:
        killer.cancel()
        killer.join()
    raise AssertionError(f"the call did not print {word} within {limit} s; it said: {''.join(said)}")
