"""Hold-ups of this computer: for how long it does not let a process run that only waits, as a guard does.

Measured in a process of its own, ``python -m coneskin.commissioning.examination.hold_ups SECONDS``: what the one that
asks does meanwhile would count as well.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

from coneskin.core.child_process import shorten_time_slice
from coneskin.core.finding import Finding, Verdict
from coneskin.core.process_watch import load

_WAKE_PERIOD = 0.002  # s; a guard wakes as often
_LONG_TIME = 0.02  # s; a guard that was held up for longer reports it
_MAX_TIME = 0.05  # s; what a scene allows a skin or a controller by default
_NICE_LIMIT = 35  # of RLIMIT_NICE, for the nice value of -15 that a guard asks for


def begin_measurement(seconds: float) -> subprocess.Popen[str]:
    """Begin to measure for a time [s]."""
    command = [sys.executable, "-P", "-m", __name__, repr(seconds)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)


def examine_hold_ups(measurement: subprocess.Popen[str]) -> Finding:
    """Wait for the end of a measurement, and return what it has found, with what to do about it."""
    told, _ = measurement.communicate()
    found = json.loads(told or '{"seconds": 0.0, "late": []}')
    late = [seconds for seconds in found["late"] if seconds > _LONG_TIME]
    longest = max(found["late"], default=0.0)
    verdict: Verdict = "ok" if longest <= _LONG_TIME else "warning"
    value = f"{1e3 * longest:.0f} ms at most, {len(late)} above {1e3 * _LONG_TIME:.0f} ms in {found['seconds']:g} s"
    remedy = "end what else runs, or use a computer with more cores"
    if not _may_come_first():
        remedy += "; let the guard come first: '@GROUP - nice -15' in /etc/security/limits.d/coneskin.conf"
    if longest > _MAX_TIME:
        remedy += "; or a firmware that sends fewer frames a second"
    item = "computer, hold-ups"
    return Finding(item, verdict, f"{value}, {load()}", f"{1e3 * _LONG_TIME:.0f} ms", remedy if late else "")


def _may_come_first() -> bool:
    """Tell whether this user's processes may have the priority that a guard asks for."""
    if sys.platform != "linux":
        return True
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NICE)
    return os.geteuid() == 0 or soft in (resource.RLIM_INFINITY, -1) or soft >= _NICE_LIMIT


def _main(seconds: float) -> None:
    shorten_time_slice()
    late, end = [], time.monotonic() + seconds
    while (asked := time.monotonic()) < end:
        time.sleep(_WAKE_PERIOD)
        late.append(time.monotonic() - asked - _WAKE_PERIOD)
    print(json.dumps({"seconds": seconds, "late": sorted(late)[-1000:]}))


if __name__ == "__main__":
    _main(float(sys.argv[1]))
