"""Three-dimensional pictures of scenes and their paths."""
