"""Heartbeats of a guard: its companions' clocks and silences, and the count on which a controller depends."""
