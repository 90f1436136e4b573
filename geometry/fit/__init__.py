"""Fit of the frusta that cover a link mesh."""
