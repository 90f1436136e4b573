"""Untouched sensor: what a detector learns of it while nothing touches: currents, guides, leak and level."""
