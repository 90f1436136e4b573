"""Reactions and measures that several tests of the guard share."""

from coneskin.robot.reaction.types import Reaction

SLOW = Reaction(kind="slow", slow_to=0.2, time_budget=1.0, press=0.1)  # how far it presses is not the matter here


def comply(**settings):
    return Reaction(kind="comply", speed=0.1, distance=0.04, arm_distance=0.5, **settings)
