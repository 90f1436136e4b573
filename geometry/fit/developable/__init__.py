"""Developable sheets whose section is not round: general cylinders and cones."""
