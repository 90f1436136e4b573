"""Detection of touches and faults in a sensor's frames."""
