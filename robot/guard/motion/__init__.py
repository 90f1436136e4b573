"""Motion of an arm under guard away from a touch: whether there is one, its setpoints, and what ends it."""
