"""Compiling kernels with numba, and keeping their code on disk."""
