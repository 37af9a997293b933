"""Scalar physics: Fresnel coefficients, polarisation, physical optics, phase integrals, diffraction."""
