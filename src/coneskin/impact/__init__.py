"""Forces of a collision, simulated, and the speeds that limits of the force permit."""
