"""Triangles as numbers: curved patches, clipping, silhouettes, closed surfaces."""
