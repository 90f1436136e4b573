"""Controller of the simulation, and the programs that it runs."""
