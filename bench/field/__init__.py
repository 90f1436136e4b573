"""Benches of the field model, beside other solvers."""
