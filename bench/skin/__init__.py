"""Benches of the skin: frames, ports, the virtual skin and its calibration."""
