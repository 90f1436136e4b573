"""Examination of a scene's hardware: what is wrong between the sensor and a guarded arm, and what to do about it."""
