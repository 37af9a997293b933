"""Slow, obvious reference solutions, written from textbook formulas and sharing no code with the package.

Common conventions: SI units, exp(+j omega t), wave number k. A scattering amplitude S [m] means
sigma = 4 pi |S|^2; matrices (2, 2) have rows receiver V, H and columns transmitter V, H. An end (radar) is a
pair (direction, distance): unit vector from the target's origin, and metres or infinity.
"""
