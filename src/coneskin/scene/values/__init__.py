"""Values that a scene file is read into."""
