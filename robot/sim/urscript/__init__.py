"""URScript of the simulated controller: values, syntax, translation to Python and mathematical functions."""
