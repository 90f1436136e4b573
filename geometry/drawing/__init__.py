"""Layers, electrodes and cut files of a sheet."""
