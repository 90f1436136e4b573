"""Permissible speed: the two-mass model of a contact, and how fast which part of an arm may move by it."""
