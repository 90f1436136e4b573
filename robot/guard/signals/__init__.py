"""Blocks, events and outputs of a guard, and what it keeps of a touch."""
