"""Triangle meshes of bodies: folds, normals, topology, and the same surface by fewer or more facets."""
