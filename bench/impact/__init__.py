"""Benches of the contact model and its integrator."""
