"""Type of the values of all joints: apart, because a process that passes them on needs no model of an arm."""

from __future__ import annotations

#: one number for each joint, from the base on
Joints = tuple[float, ...]
