"""Sheets of one link, as they are designed."""
