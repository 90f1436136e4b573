"""Recorded runs as material: found, summed up, cut, compared, exported, and tried with other settings."""
