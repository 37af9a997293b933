"""Scattering by an infinitely long, perfectly conducting strip, by the method of moments."""

import numpy as np
from scipy.special import hankel2

GAMMA = 1.781072418  # of the logarithm in Hankel's function at small arguments


def _pulses(apart, step):
    """Return the integrals of Hankel's function over pulses of width step at distances, both over wavelength / 2 pi."""
    self_term = 1.0 - 2j / np.pi * np.log(GAMMA * step / (4.0 * np.e))
    near = apart < 1e-9
    return step * np.where(near, self_term, hankel2(0, np.where(near, 1.0, apart)))


def strip(width, arrival, departure, along, cells=None):
    """Return what a strip scatters, and physical optics' part of it: integrals of the current, over wavelength / 2 pi.

    Args: width times 2 pi / wavelength; arrival, departure angles [rad] from the normal, of departures one or many;
    along, which field is along the edges, "E" or "H".
    """
    departure = np.asarray(departure)
    count = cells or max(60, int(20 * width))
    step = width / count
    ends = np.linspace(-0.5 * width, 0.5 * width, count + 1)
    middle = 0.5 * (ends[1:] + ends[:-1])
    if along == "E":
        matrix = 0.25 * _pulses(np.abs(middle[:, None] - middle), step)
        at, cosine = middle, 1.0
        optics = 2.0 * np.cos(arrival) * np.exp(1j * middle * np.sin(arrival))
        current = np.linalg.solve(matrix, np.exp(1j * at * np.sin(arrival)))
    else:
        at, cosine = ends[1:-1], np.cos(departure)
        # Currents are hats about the inner ends, charges pulses on the cells; fields are tested between middles.
        charge = 0.25 * _pulses(np.abs(middle[:, None] - middle), step)
        slope = (np.eye(count, count - 1) - np.eye(count, count - 1, -1)) / step
        matrix = 0.25 * _pulses(np.abs(at[:, None] - at), step) + np.diff(charge @ slope, axis=0) / step
        optics = 2.0 * np.exp(1j * middle * np.sin(arrival))
        current = np.linalg.solve(matrix, np.cos(arrival) * np.exp(1j * at * np.sin(arrival)))
    whole = np.exp(1j * at * np.sin(departure)[..., None]) @ current * step * cosine
    return whole, np.exp(1j * middle * np.sin(departure)[..., None]) @ optics * step * cosine
