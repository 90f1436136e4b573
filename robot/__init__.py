"""Robot arm: kinematics, driver, reactions, stops, guard and simulated controller. May import skin and geometry."""

if __name__ != "coneskin.robot":
    raise ImportError("import coneskin.robot: the folder robot/ is a part of the package coneskin")
