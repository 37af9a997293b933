"""Scene files: their tables and keys, read and written."""
