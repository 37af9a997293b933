"""Where the level of a map cell comes from."""
