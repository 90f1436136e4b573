"""Benches of the simulated controller with clients that others wrote."""
