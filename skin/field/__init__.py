"""Electric field of the sheets, solved exactly."""
