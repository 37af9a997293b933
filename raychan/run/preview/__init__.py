"""A frame in a fraction of a second: each body scatters once."""
