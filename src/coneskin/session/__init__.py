"""Guarded session: its processes, its events, the arm for a program, and the fallback stop."""
