"""Physics in the loop: an arm that runs into bodies, simulated by MuJoCo, and the force that its skin feels."""
