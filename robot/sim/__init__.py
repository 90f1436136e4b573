"""Simulated UR controller that ur_rtde connects to."""
