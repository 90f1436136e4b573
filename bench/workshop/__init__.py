"""Benches of what a workshop builds from a design."""
