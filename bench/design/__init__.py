"""Benches of the fit of sheets to links."""
