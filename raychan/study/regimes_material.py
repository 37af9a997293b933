"""Regimes of materials: Brewster's angle, total reflection, layers of any thickness, permittivity toward 1."""

from __future__ import annotations

import numpy as np

from raychan.em.fresnel import HALF_SPACE, LAYER, coefficients, coefficients_array
from raychan.run.rcs import rcs
from raychan.run.specular_paths import specular_paths
from raychan.study.regimes_base import FREQUENCY, LAMBDA, Complexes, Floats, K, Outcome, Regime, Row, at_most, same_db
from raychan.world.body import Body
from raychan.world.material import Material
from raychan.world.scene import Scene
from raychan.world.shapes import build

_FRESNEL = "closed form: Fresnel"


def brewster(quick: bool) -> Outcome:
    """Check Brewster's angle, at which the p polarisation has no reflection: coefficients, specular paths, a plate."""
    rows = []
    for eps in (1.5, 3.18, 6.31, 30.0):
        cosine = 1.0 / np.sqrt(1.0 + eps)
        r = coefficients(HALF_SPACE, complex(eps), 0.0, 0.0, cosine, K)
        rows.append(at_most(f"|R_p| at Brewster's angle, eps {eps:g}", abs(r[1]), 1e-14, "", _FRESNEL))
        exact = (eps - 1.0) / (eps + 1.0)
        rows.append(Row(f"|R_s| at Brewster's angle, eps {eps:g}", exact, abs(r[0]), 1e-12, "", _FRESNEL))
    height, eps = 1.0, 3.18
    road = Body(name="road", shape="ground", params={"size": 200.0}, material=Material(eps))
    # Both ends 1 m up, tan(angle of incidence) = half the distance over the height = sqrt(eps).
    reach = 2.0 * height * np.sqrt(eps)
    p = specular_paths(Scene(bodies=[road], frequency=FREQUENCY), (0, 0, height), (reach, 0, height), 1)
    free = LAMBDA / (4 * np.pi * p.length[1])
    rows.append(at_most("path over a road at Brewster's angle, V", abs(p.gain[1, 0, 0]) / free, 1e-12, "", _FRESNEL))
    angle = float(np.degrees(np.arctan(np.sqrt(eps))))
    plate = build("plate", {"width": 0.1, "height": 0.1})
    mirror = [
        rcs(plate, FREQUENCY, angle, 0.0, way, material=Material(eps), rx_azimuth_deg=-angle, max_bounces=1)
        for way in ("HH", "VV")
    ]
    metal = 4 * np.pi * (0.01 * np.cos(np.radians(angle)) / LAMBDA) ** 2
    # The plane of incidence is level: H lies in it.
    share = float(np.sqrt(mirror[0].sigma / metal))
    rows.append(at_most("plate in mirror direction at Brewster's angle, in plane", share, 1e-7, "", _FRESNEL))
    exact = metal * ((eps - 1) / (eps + 1)) ** 2
    rows.append(same_db("the same across the plane", float(mirror[1].sigma), exact, 0.05, _FRESNEL))
    return Outcome(rows)


def total_reflection(quick: bool) -> Outcome:
    """Check total reflection by a medium of lower permittivity, 0.25, beyond its critical angle."""
    rows = []
    eps = 0.25 + 0j
    critical = np.arcsin(0.5)
    worst = 0.0
    for angle in np.radians([30.001, 31.0, 45.0, 60.0, 80.0, 89.9]):
        r = coefficients(HALF_SPACE, eps, 0.0, 0.0, float(np.cos(angle)), K)
        worst = max(worst, abs(abs(r[0]) - 1.0), abs(abs(r[1]) - 1.0))
    rows.append(at_most("eps 0.25 beyond the critical angle: | |R| - 1 |", worst, 1e-12, "", "energy"))
    r = coefficients(HALF_SPACE, eps, 0.0, 0.0, float(np.cos(critical)), K)
    rows.append(Row("eps 0.25 at the critical angle: |R_s|", 1.0, abs(r[0]), 1e-6, "", _FRESNEL))
    for thickness in (1e-4, 1e-3, 1e-1, 1.0, 10.0):
        c = coefficients(LAYER, eps, thickness, 0.0, float(np.cos(np.radians(45.0))), K)
        power = abs(c[0]) ** 2 + abs(c[2]) ** 2
        rows.append(Row(f"tunnelling through {thickness:g} m of eps 0.25: R + T", 1.0, power, 1e-9, "", "energy"))
    cosine = np.sqrt(0.5)
    r = coefficients(HALF_SPACE, eps, 0.0, 0.0, float(cosine), K)
    # The evanescent wave decays away from the face; the other root would change the sign of the phase.
    exact = 2.0 * float(np.arctan(0.5 / cosine))
    rows.append(Row("eps 0.25 at 45 deg: phase of R_s", exact, float(np.angle(r[0])), 1e-12, "rad", _FRESNEL))
    wall = Body(name="road", shape="ground", params={"size": 4000.0}, material=Material(5.0))
    scene = Scene(bodies=[wall], frequency=FREQUENCY)
    p = specular_paths(scene, (0, 0, 1e-3), (1000.0, 0, 1e-3), 1)
    free = LAMBDA / (4 * np.pi * p.length)
    last = np.abs(p.gain[-1, 1, 1]) / free[-1]
    # For small sines R_s = -(1 - 2 s / root).
    sine = 2e-3 / 1000.0
    rows.append(Row("road at 0.0001 deg: |R_s|", 1 - 2 * sine / np.sqrt(4.0), float(last), 1e-9, "", _FRESNEL))
    return Outcome(rows)


def layers(quick: bool) -> Outcome:
    """Check layers from 1e-15 m to 1 km: thin ones against the first-order film, thick ones against the half space."""
    rows = []
    angle = np.radians(40.0)
    c = float(np.cos(angle))
    glass = 6.31 - 0.3j
    thick = np.logspace(-15, 3, 19)
    seen_all, film_all = [], []
    half = coefficients(HALF_SPACE, glass, 0.0, 0.0, c, K)
    for d in thick:
        got = coefficients(LAYER, glass, float(d), 0.0, c, K)
        film = _film(glass, float(d), c)
        seen_all.append(np.abs(got[:2]))
        film_all.append(np.abs(film))
        if d <= 1e-7:
            off = max(abs(got[i] / film[i] - 1.0) for i in (0, 1))
            # Next order: about k d |eps|; rounding: 1e-16 over k d.
            slack = 10.0 * K * d * abs(glass) + 1e-15 / (K * d)
            note = f"rounding alone allows {1e-15 / (K * d):.1e}"
            rows.append(
                Row(f"film of {d:.0e} m: R over its first order", 0.0, float(off), slack, "", "series in k d", note)
            )
        if d >= 0.1:
            off = max(abs(got[i] - half[i]) for i in (0, 1)) + abs(got[2]) + abs(got[3])
            lost = np.exp(K * d * np.sqrt(glass - 1 + c * c).imag)
            rows.append(
                Row(f"slab of {d:g} m: R is a half space's", 0.0, float(off), 3 * float(lost) + 1e-12, "", "limit")
            )
    return Outcome([*rows, *_passive(quick), *_plates()], {"thickness": thick, "seen": seen_all, "film": film_all})


def _film(eps: complex, d: float, c: float) -> Complexes:
    """Return R_s, R_p of a film to first order in its thickness (Born and Wolf 1999, sec. 1.6, as a series)."""
    s2 = 1.0 - c * c
    r_s = -1j * K * d * (eps - 1.0) / (2.0 * c)
    r_p = 1j * K * d * (eps * c * c - (eps - s2) / eps) / (2.0 * c)
    return np.array([r_s, r_p])


def _passive(quick: bool) -> list[Row]:
    """Return checks of reflected plus transmitted power over random materials and angles."""
    rng = np.random.default_rng(5)
    n = 100_000
    eps = 1.0 + 10.0 ** rng.uniform(-6, 2, n) + 0j
    cosine: Floats = np.sin(10.0 ** rng.uniform(-4, np.log10(np.pi / 2), n))
    d = 10.0 ** rng.uniform(-6, 0, n)
    rows = []
    for name, loss in (("without loss", 0.0), ("with loss", 1.0)):
        lossy = eps - 1j * loss * 10.0 ** rng.uniform(-6, 3, n)
        kinds = rng.choice([HALF_SPACE, LAYER], n) if loss else np.full(n, LAYER)
        p = np.abs(coefficients_array(kinds, lossy, d, np.zeros(n), cosine, K)) ** 2
        total = np.maximum(p[:, 0] + p[:, 2], p[:, 1] + p[:, 3])
        bad = int((~np.isfinite(total)).sum())
        rows.append(Row(f"{n} random layers {name}: not finite", 0, bad, 0, "layers", "energy"))
        rows.append(at_most(f"{n} random layers {name}: R + T", float(np.nanmax(total)), 1 + 1e-9, "", "energy"))
        if not loss:
            least = float(np.nanmin(np.minimum(p[:, 0] + p[:, 2], p[:, 1] + p[:, 3])))
            rows.append(Row(f"{n} random layers {name}: least R + T", 1.0, least, 1e-9, "", "energy"))
    return rows


def _plates() -> list[Row]:
    """Return checks of the RCS of plates of thin layers against the first-order film."""
    rows = []
    plate = build("plate", {"width": 0.1, "height": 0.1})
    metal = 4 * np.pi * (0.01 / LAMBDA) ** 2
    for d in (1e-5, 2e-6):
        r = rcs(plate, FREQUENCY, 0.0, material=Material(4.0, thickness=d), max_bounces=1)
        exact = metal * (K * d * 3.0 / 2.0) ** 2
        rows.append(same_db(f"plate of {d:g} m of eps 4", float(r.sigma), exact, 0.05, "series in k d"))
    return rows


def toward_vacuum(quick: bool) -> Outcome:
    """Check permittivities toward 1: the reflection falls in proportion to eps - 1 and is 0 at 1."""
    rows = []
    steps = 10.0 ** -np.arange(1.0, 14.0)
    seen = []
    for step in steps:
        got = coefficients(HALF_SPACE, complex(1.0 + step), 0.0, 0.0, 1.0, K)[0]
        root = np.sqrt(1.0 + step)
        exact = step / (1.0 + root) ** 2
        seen.append(abs(got))
        # Absolute: (1 - root) keeps 1e-16, which is -320 dB.
        rows.append(Row(f"|R| head-on, eps 1 + {step:.0e}", exact, abs(got), 2e-16, "", _FRESNEL))
    none = coefficients(HALF_SPACE, 1.0 + 0j, 0.0, 0.0, 0.3, K)
    rows.append(at_most("eps 1: |R|", max(abs(none[0]), abs(none[1])), 1e-15, "", _FRESNEL))
    same = coefficients(LAYER, 1.0 + 0j, 0.01, 0.0, 0.3, K)
    rows.append(Row("layer of eps 1: T", 0.0, abs(same[2] - 1.0), 1e-12, "off 1", _FRESNEL))
    r = rcs(build("plate", {"width": 0.1, "height": 0.1}), FREQUENCY, 10.0, material=Material(1.0), max_bounces=1)
    rows.append(at_most("plate of eps 1: sigma", float(r.sigma), 1e-20, "m2", "energy: nothing is there"))
    return Outcome(rows, {"step": steps, "seen": np.array(seen)})


REGIMES = (
    Regime("brewster", "Brewster's angle", brewster),
    Regime("total", "Total reflection", total_reflection),
    Regime("layers", "Vanishing and very thick layers", layers),
    Regime("vacuum", "Permittivity toward 1", toward_vacuum),
)
