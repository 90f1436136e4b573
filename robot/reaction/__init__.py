"""Reactions to a touch: retreat, admittance, backtrack and the rules that choose one. Pure functions."""
