"""Fault campaign: faults at random times, and whether the arm stands in time."""
