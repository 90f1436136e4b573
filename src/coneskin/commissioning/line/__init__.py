"""Monitor of a skin's line: what arrives on it, without an arm and without a scene."""
