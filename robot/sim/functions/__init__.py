"""URScript functions of the simulated controller, and what they see of it."""
