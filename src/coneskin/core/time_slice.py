"""Time slice of a process: how long it computes before Linux lets another in, and so how soon it is let in itself.

A process that wakes is let in before one that computes only where its time is due sooner, and it is due after a slice.
With slices of 0.1 ms a frame waits for less beside, say, a browser that draws on the processor; the share of the
processor is as before, which is what nice values divide. Any process may ask for it, from Linux 6.12 on (sched(7) and
sched_setattr(2); EEVDF, whose slice is ``sched_runtime``); an older kernel ignores it, other systems have no such call.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys

__all__ = ["shorten_time_slice"]

_MIN_SLICE = 100_000  # ns that Linux takes
_ORDINARY_POLICY = 0  # policy of ordinary processes
#: sched_attr: size, policy, flags, nice, priority, runtime, deadline, period; times in ns
_SCHED_ATTRIBUTES = struct.Struct("<IIQiIQQQ")
#: machine -> numbers of the calls sched_getattr and sched_setattr, which Python does not have
_CALL_NUMBERS = {"x86_64": (315, 314), "aarch64": (275, 274), "riscv64": (275, 274)}


def shorten_time_slice() -> None:
    """Ask for the shortest time slices for this thread, and all that it starts from now on.

    Call it before anything starts a thread. Where it is not to be had, all is as it was.
    """
    calls = _CALL_NUMBERS.get(os.uname().machine) if sys.platform == "linux" else None
    if calls is None or sys.maxsize < 2**32:  # a process of 32 bits on such a kernel has other numbers
        return
    call = ctypes.CDLL(None).syscall
    data = ctypes.create_string_buffer(_SCHED_ATTRIBUTES.size)
    if call(calls[0], 0, data, _SCHED_ATTRIBUTES.size, 0) != 0:
        return
    size, policy, _, nice, *_ = _SCHED_ATTRIBUTES.unpack(data.raw)
    if policy == _ORDINARY_POLICY:
        data.raw = _SCHED_ATTRIBUTES.pack(size, policy, 0, nice, 0, _MIN_SLICE, 0, 0)
        call(calls[1], 0, data, 0)
