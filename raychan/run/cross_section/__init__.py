"""The cross-section of a body by itself: launches, their error, and what physical optics leaves out."""
