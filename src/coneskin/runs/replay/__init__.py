"""Replay of recorded runs: the same inputs through today's guard, as events, text and picture."""
