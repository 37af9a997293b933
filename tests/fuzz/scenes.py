"""Random small scenes, all of them valid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fuzz import meshes

_MATERIALS = ["pec", "glass", "concrete", "metal", "car_glass", "plastic", "skin", "own"]
_WINDOWS = ["rect", "hann", "hamming", "blackman", "taylor", "chebyshev(60)"]


def scene(rng: Any, folder: Path | None = None) -> dict[str, Any]:
    """Return the tables of a scene; with a folder, some bodies are meshes written there."""
    waveform = {
        "carrier_ghz": float(rng.choice([24.0, 77.0, 79.0])),
        "bandwidth_mhz": float(rng.uniform(100.0, 4000.0)),
        "chirp_us": float(rng.uniform(5.0, 60.0)),
        "chirps": int(rng.choice([1, 2, 7, 16, 32, 33])),
        "samples": int(rng.choice([16, 31, 64, 128])),
        "iq": bool(rng.random() < 0.8),
    }
    radar = {
        "position": [0.0, 0.0, float(rng.uniform(0.3, 1.5))],
        "yaw_deg": float(rng.uniform(-20.0, 20.0)),
        "velocity_mps": [float(rng.uniform(0.0, 20.0)), 0.0, 0.0],
        "power_dbm": float(rng.uniform(0.0, 30.0)),
        "noise": bool(rng.random() < 0.8),
        "polarization": str(rng.choice(["V", "H"])),
        "antenna": _antenna(rng),
        "waveform": waveform,
    }
    if rng.random() < 0.3:
        radar["elements_mm"] = [[0.0, 1.9 * i, 0.0] for i in range(int(rng.integers(2, 5)))]
    processing = {
        "range_window": str(rng.choice(_WINDOWS)),
        "rate_window": str(rng.choice(_WINDOWS)),
        "pad": [int(rng.integers(1, 4)), int(rng.integers(1, 4))],
        "cfar": str(rng.choice(["os", "ca"])),
        "pfa": float(10.0 ** rng.uniform(-9.0, -3.0)),
        "min_snr_db": float(rng.uniform(5.0, 25.0)),
    }
    model = {
        "mode": str(rng.choice(["physical", "physical", "auto", "preview"])),
        "max_bounces": int(rng.integers(1, 4)),
        "max_transmissions": int(rng.integers(0, 4)),
        "tolerance_db": float(rng.uniform(3.0, 6.0)),
        "diffraction": bool(rng.random() < 0.2),
    }
    own = {"eps_r": float(rng.uniform(1.0, 9.0)), "sigma": float(rng.choice([0.0, 0.1])), "thickness_mm": 3.0}
    bodies = [_body(rng, i, folder) for i in range(int(rng.integers(0, 4)))]
    if rng.random() < 0.5:
        bodies.insert(0, {"name": "ground", "shape": "ground"})
    return {
        "scene": {"title": "a scene"},
        "radar": radar,
        "processing": processing,
        "model": model,
        "materials": {"own": own},
        "bodies": bodies,
    }


def _antenna(rng: Any) -> dict[str, Any]:
    kind = rng.integers(4)
    if kind == 0:
        return {"kind": "isotropic", "front": bool(rng.random() < 0.5)}
    if kind == 1:
        return {"kind": "cosine", "hpbw_h_deg": float(rng.uniform(1.0, 120.0)), "hpbw_v_deg": 60.0}
    row = {"kind": "array", "ny": int(rng.integers(1, 9)), "nz": int(rng.integers(1, 5)), "taper_y": "taylor"}
    return row | ({"gain_dbi": 12.0} if kind == 2 else {"spacing_y": float(rng.uniform(0.3, 1.2))})


def _body(rng: Any, number: int, folder: Path | None) -> dict[str, Any]:
    body: dict[str, Any] = {"name": f"b{number}"}
    if folder is not None and rng.random() < 0.4:
        body["mesh"] = meshes.written(folder, f"mesh{number}", rng).name
    else:
        name = str(rng.choice(["plate", "sphere", "box", "cylinder", "trihedral", "dihedral", "wall"]))
        body["shape"] = name
        body["params"] = {
            "plate": {"width": float(rng.uniform(0.1, 1.0)), "height": float(rng.uniform(0.1, 1.0))},
            "sphere": {"radius": float(rng.uniform(0.02, 0.3)), "max_sag": 0.003},
            "box": {"length": float(rng.uniform(0.1, 2.0)), "width": float(rng.uniform(0.1, 1.0))},
            "cylinder": {"radius": float(rng.uniform(0.02, 0.2)), "max_sag": 0.003},
            "trihedral": {"size": float(rng.uniform(0.05, 0.2)), "square": bool(rng.random() < 0.5)},
            "dihedral": {"size": float(rng.uniform(0.05, 0.2))},
            "wall": {"length": float(rng.uniform(0.5, 2.0)), "height": 1.0},
        }[name]
    body["position"] = [float(rng.uniform(1.5, 12.0)), float(rng.uniform(-3.0, 3.0)), float(rng.uniform(0.0, 1.5))]
    for angle in ("yaw_deg", "pitch_deg", "roll_deg"):
        if rng.random() < 0.6:
            body[angle] = float(rng.choice([rng.uniform(-180.0, 180.0), 180.0, 90.0]))
    if rng.random() < 0.6:
        body["velocity_mps"] = rng.uniform(-20.0, 20.0, 3).tolist()
    if rng.random() < 0.7:
        body["material"] = str(rng.choice(_MATERIALS))
    if rng.random() < 0.2:
        body["rcs_dbsm"] = float(rng.uniform(-10.0, 20.0))
    if rng.random() < 0.1:
        body["spin_dps"] = [0.0, float(rng.uniform(-500.0, 500.0)), 0.0]
    return body
