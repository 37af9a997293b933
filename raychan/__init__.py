"""raychan: a ray-traced radar channel simulator on Embree."""
