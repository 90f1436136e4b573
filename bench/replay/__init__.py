"""Benches of recordings: damage, size, speed and memory."""
