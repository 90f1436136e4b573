"""What frames say: readings, contact matrices, timing, faults, and the untouched sensor."""
