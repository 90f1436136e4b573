"""Firmware: the sketch of a board that drives and reads one sensor, its pin table, wiring and parts."""
