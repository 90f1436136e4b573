"""Sources: the bytes of a real sensor."""
