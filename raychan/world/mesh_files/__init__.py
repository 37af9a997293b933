"""Meshes from files: readers, and what is wrong with a file in words of its own."""
