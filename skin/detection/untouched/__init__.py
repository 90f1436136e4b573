"""What a detector learns while nothing touches: currents, guides, leak and level of the sensor itself."""
