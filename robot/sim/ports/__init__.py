"""Ports of the simulated controller: what its clients are told, and what they may send."""
