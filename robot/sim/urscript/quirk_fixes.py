"""Corrected functions for the control program of ur_rtde, used with ``--quirks fixed``.

They are written for this simulator. A program without a function of such a name is not changed.
"""

from __future__ import annotations

__all__ = ["QUIRK_FIXES"]

#: definition in which stopL and stopJ do what their names say, and end the speed and servo threads first
_STOP = """
def exec_stopl_stopj(command, message):
  deceleration = read_input_float_reg(0)
  background = read_input_integer_reg(1)
  enter_critical
  if stop_thrd != 0:
    kill stop_thrd
    global stop_thrd = 0
    signal_async_operation_finished()
  end
  kill speed_thrd
  kill servo_thrd
  kill servoc_thrd
  global speed_thrd = 0
  global servo_thrd = 0
  global servoc_thrd = 0
  global is_speeding = 0
  global is_servoing = 0
  exit_critical
  stop_async_move()
  global stop_dec = deceleration
  if command == 33:
    global stop_type = 1
  else:
    global stop_type = 0
  end
  if background == 1:
    global stop_thrd = run stop_thread()
  elif stop_type == 1:
    stopl(deceleration)
  else:
    stopj(deceleration)
  end
end
"""

#: name of a function of the uploaded program -> corrected definition
QUIRK_FIXES = {"exec_stopl_stopj": _STOP}
