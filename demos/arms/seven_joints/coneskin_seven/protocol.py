"""Wire of the simulated controller: one fixed state, and lines of text."""

import struct

STATE_PORT, COMMAND_PORT = 7701, 7702
STATE = struct.Struct("<4sd7d7dB")  #: mark, clock [s], positions [rad], speeds [rad/s], whether a program runs
MARK = b"SEVN"
