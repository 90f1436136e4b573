"""State of the simulated controller: safety, power, inputs, options, notices."""
