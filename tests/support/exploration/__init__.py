"""Exploration of the guard to the end of its states, and of the processes around it."""
