"""Speed of an arm under guard: its limit, and its reduction while the skin is touched."""
