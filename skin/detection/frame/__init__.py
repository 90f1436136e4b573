"""What one frame says: currents, matrices, timing, faults."""
