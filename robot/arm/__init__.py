"""Geometry, kinematics and limits of an arm, without input or output."""
