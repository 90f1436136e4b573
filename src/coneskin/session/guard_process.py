"""Guard process: it runs the guard's loop alone. Started by ``coneskin.session.session``."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from pathlib import Path

from coneskin.core.channel import wait_writable
from coneskin.core.child_process import first_message, inherit, shorten_time_slice
from coneskin.core.errors import ConeSkinError
from coneskin.core.recording.block import encode_block

_NICE_VALUE = -15  # nice value; more would be in the way of the kernel's own threads
_AUTOGROUP_FILE = Path("/proc/self/autogroup")  # of sched(7): nice values only count among the processes of one session


def main(arguments: list[str]) -> int:
    """Take the channels and the scene, open what it names, and run until the guard is to end."""
    shorten_time_slice()
    lifeline, (session, *others) = inherit(arguments)
    # while the other processes start; not above, because the program may be gone before all of it is loaded
    from coneskin.robot.guard.signals.journal import EventName, GuardEvent, RecordingOverflowFilter
    from coneskin.scene.reader import parse_scene
    from coneskin.scene.values.scene import Commissioning

    from .guard_run import run_guard

    session.overflow = RecordingOverflowFilter()
    if (start := first_message(session)) is None:
        return 1
    with contextlib.suppress(OSError):
        os.nice(_NICE_VALUE)  # allowed for root, and where the user's limits say so
        if os.getsid(0) == os.getpid():  # Linux may first divide its time among sessions; this one is the guard's own
            _AUTOGROUP_FILE.write_text(str(_NICE_VALUE))
    try:
        known = Commissioning.from_message(start["commissioning"])
        scene = parse_scene(start["scene"], start["name"], Path(start["folder"]), commissioning=known)
        with contextlib.ExitStack() as stack:
            run_guard(scene, start, session, others, lifeline, stack)
    except ConeSkinError as exc:
        event = GuardEvent(EventName.GUARD_EXITED, time.monotonic(), {"what": str(exc), "error": type(exc).__name__})
        session.send(encode_block(event.block()))
        wait_writable(session, 1.0)
        session.flush()
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
