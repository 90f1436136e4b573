"""Benches of the reaction: its times, its stops, and the motion after a touch."""
