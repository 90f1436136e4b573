"""The arm: kinematics, reactions, ur_rtde, the simulated controller, the guard loop. May import skin and geometry."""

if __name__ != "coneskin.robot":
    raise ImportError("import coneskin.robot: the folder robot/ is a part of the package coneskin")
