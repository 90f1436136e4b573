"""Emulated board: the sketch as compiled, run cycle by cycle, with its circuit and the exact field around it."""
