"""Solids of a sheet: the closed surface of a printed jig, STL, and the wrapped layers for CAD."""
