"""Page in a browser on which the sheets for a link are designed: cones, handles, layers, and what it will measure."""
