"""Scenes: bodies, materials, meshes, motion, and the geometry that rays meet."""
