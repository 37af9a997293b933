"""Bodies whose cross-section is known, how it is seen, and one launch over it."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import trimesh
from truth import corner, po, slab

from raychan.run.cross_section.refinement import refinements
from raychan.run.cross_section.scattering import scattering
from raychan.tracing.legs import Leg
from raychan.units import C0
from raychan.world.geometry import Geometry
from support.facets import quad

F = 77e9


K = 2.0 * np.pi * F / C0


POLARIZATIONS = {"VV": (0, 0), "HH": (1, 1)}


def db(x):
    """Return 10 log10 of a power ratio."""
    return 10.0 * np.log10(x)


def sigma(s, pol="VV"):
    """Return the radar cross-section [m^2] of a scattering matrix."""
    return 4.0 * np.pi * np.abs(s[POLARIZATIONS[pol]]) ** 2


def view(azimuth_deg, elevation_deg=0.0, distance=np.inf):
    """Return an end: its direction (3,), by angles [deg], and its distance [m]."""
    return po.direction(np.radians(azimuth_deg), np.radians(elevation_deg)), distance


def ball(radius, subdivisions):
    """Return a sphere of `radius` [m] as a subdivided icosahedron."""
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def tube(radius, height, sections):
    """Return a closed cylinder [m]."""
    return trimesh.creation.cylinder(radius=radius, height=height, sections=sections)


def amplitudes(facets, look, distance=np.inf, step=1, move=0.0, **changes):
    """Scattering matrix (2, 2) [m] of one launch, the `step`-th refinement; seen from look * distance + move."""
    geometry = Geometry(facets)
    rule = dataclasses.replace(next(itertools.islice(refinements(geometry, F), step, None)), **changes)
    leg = Leg(end=look, far=True) if np.isinf(distance) else Leg(end=look * distance + move)
    return scattering(geometry, leg, leg, F, 3, rule).sum(axis=0)


def rms(x):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def slab_of(material):
    """Return the reflection coefficients of a material by their own formulas, as a function of the cosine."""
    eps = material.eps_r - 1j * material.sigma / (2 * np.pi * F * 8.8541878128e-12)
    if material.thickness is None:
        return lambda c: slab.half_space(c, eps)
    return lambda c: slab.layer(c, eps, material.thickness, K)[:2]


def bodies():
    """Return one body of each kind, by name."""
    return {
        "plate": quad(po.rectangle(0.2, 0.1)),
        "sphere": ball(0.1, 3),
        "cylinder": tube(0.05, 0.2, 48),
        "box": trimesh.creation.box((0.2, 0.15, 0.1)),
        "dihedral": corner.mesh(corner.dihedral_faces(0.15, 0.1)),
        "trihedral": corner.mesh(corner.trihedral_faces(0.1, True)),
    }
