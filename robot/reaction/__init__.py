"""Reactions to a touch: retreat, admittance and the rules that choose one. Pure functions."""
