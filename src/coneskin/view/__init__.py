"""Page in a browser on which a guarded arm, its skin and their runs are seen; no safety display."""
