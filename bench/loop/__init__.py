"""Benches of the guard's loop: its stages, its baseline, its start and its endurance."""
