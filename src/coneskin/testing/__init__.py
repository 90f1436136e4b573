"""Rigs, mock arms and references that tests and benches share, and that tests of a user's program may use too."""
