"""Calibration of a skin: known places are touched, and what the skin reads wrongly is learned from them."""
