"""raychan: a ray-traced radar channel simulator on Embree.

The public names below are loaded when first used, so that `import raychan` costs nothing.
"""

from __future__ import annotations

import os

TYPE_CHECKING = False  # as `typing` has it, whose import takes most of the time in which a Ctrl-C is a traceback
_PLACES = (os.path.dirname(__file__), os.path.expanduser("~"))
if "NUMBA_CACHE_DIR" not in os.environ and not any(os.access(place, os.W_OK) for place in _PLACES):
    # Compiled loops are kept beside the package or in the home; where neither can be written, numba refuses to run.
    import atexit
    import shutil
    import tempfile

    os.environ["NUMBA_CACHE_DIR"] = _kept = tempfile.mkdtemp(prefix="raychan-")
    atexit.register(shutil.rmtree, _kept, ignore_errors=True)

_HOME = {
    "Scene": "raychan.world.scene",
    "Body": "raychan.world.body",
    "SceneError": "raychan.world.errors",
    "Diffuse": "raychan.em.diffuse",
    "Material": "raychan.world.material",
    "PEC": "raychan.world.material",
    "Radar": "raychan.radar.radar",
    "Waveform": "raychan.radar.waveform",
    "uniform_array": "raychan.radar.array",
    "mimo_array": "raychan.radar.array",
    "Antenna": "raychan.radar.antenna",
    "IsotropicAntenna": "raychan.radar.antenna",
    "CosineAntenna": "raychan.radar.antenna",
    "ArrayAntenna": "raychan.radar.antenna",
    "MeasuredAntenna": "raychan.radar.pattern",
    "load_antenna": "raychan.world.scene_files.radar_mount",
    "Processing": "raychan.radar.processing",
    "Impairments": "raychan.radar.impairments",
    "PhaseNoise": "raychan.radar.impairments",
    "ChirpError": "raychan.radar.impairments",
    "Converter": "raychan.radar.impairments",
    "Interferer": "raychan.radar.interferer",
    "Atmosphere": "raychan.em.atmosphere",
    "Paths": "raychan.records",
    "SpecularPaths": "raychan.records",
    "InteractionType": "raychan.kinds",
    "simulate": "raychan.run.simulate",
    "trace": "raychan.run.stages",
    "transfer": "raychan.run.stages",
    "synthesize": "raychan.run.stages",
    "range_doppler": "raychan.run.stages",
    "detect": "raychan.run.stages",
    "range_azimuth": "raychan.run.explanation.directions",
    "RangeAzimuth": "raychan.processing.range_azimuth",
    "doa": "raychan.processing.doa",
    "SceneRoutes": "raychan.run.stages",
    "Detector": "raychan.processing.detection_theory",
    "detection_probability": "raychan.processing.detection_theory",
    "frames": "raychan.run.sequence",
    "Result": "raychan.run.result",
    "explain": "raychan.run.explain",
    "load_result": "raychan.run.storage",
    "save_result": "raychan.run.storage",
    "StoreError": "raychan.run.files.output",
    "spectrogram": "raychan.run.spectrogram",
    "Spectrogram": "raychan.run.spectrogram",
    "rcs": "raychan.run.rcs",
    "specular_paths": "raychan.run.specular_paths",
    "visibility": "raychan.study.visibility",
}
"""Where each public name is at home; the imports below say the same to type checkers."""

if TYPE_CHECKING:
    from typing import Any

    from raychan.em.atmosphere import Atmosphere as Atmosphere
    from raychan.em.diffuse import Diffuse as Diffuse
    from raychan.kinds import InteractionType as InteractionType
    from raychan.processing.detection_theory import Detector as Detector
    from raychan.processing.detection_theory import detection_probability as detection_probability
    from raychan.processing.doa import doa as doa
    from raychan.processing.range_azimuth import RangeAzimuth as RangeAzimuth
    from raychan.radar.antenna import Antenna as Antenna
    from raychan.radar.antenna import ArrayAntenna as ArrayAntenna
    from raychan.radar.antenna import CosineAntenna as CosineAntenna
    from raychan.radar.antenna import IsotropicAntenna as IsotropicAntenna
    from raychan.radar.array import mimo_array as mimo_array
    from raychan.radar.array import uniform_array as uniform_array
    from raychan.radar.impairments import ChirpError as ChirpError
    from raychan.radar.impairments import Converter as Converter
    from raychan.radar.impairments import Impairments as Impairments
    from raychan.radar.impairments import PhaseNoise as PhaseNoise
    from raychan.radar.interferer import Interferer as Interferer
    from raychan.radar.pattern import MeasuredAntenna as MeasuredAntenna
    from raychan.radar.processing import Processing as Processing
    from raychan.radar.radar import Radar as Radar
    from raychan.radar.waveform import Waveform as Waveform
    from raychan.records import Paths as Paths
    from raychan.records import SpecularPaths as SpecularPaths
    from raychan.run.explain import explain as explain
    from raychan.run.explanation.directions import range_azimuth as range_azimuth
    from raychan.run.files.output import StoreError as StoreError
    from raychan.run.rcs import rcs as rcs
    from raychan.run.result import Result as Result
    from raychan.run.sequence import frames as frames
    from raychan.run.simulate import simulate as simulate
    from raychan.run.spectrogram import Spectrogram as Spectrogram
    from raychan.run.spectrogram import spectrogram as spectrogram
    from raychan.run.specular_paths import specular_paths as specular_paths
    from raychan.run.storage import load_result as load_result
    from raychan.run.storage import save_result as save_result
    from raychan.study.visibility import visibility as visibility
    from raychan.world.body import Body as Body
    from raychan.world.errors import SceneError as SceneError
    from raychan.world.material import PEC as PEC
    from raychan.world.material import Material as Material
    from raychan.world.scene import Scene as Scene
    from raychan.world.scene_files.radar_mount import load_antenna as load_antenna

    __version__: str

__all__ = [*_HOME, "__version__"]


_TRIED = {
    "loadscene": "Scene.load",
    "load": "Scene.load",
    "run": "simulate",
    "music": "doa",
    "esprit": "doa",
    "capon": "doa",
    "mvdr": "doa",
    "beamform": "doa",
    "beamforming": "doa",
    "cfar": "detect",
    "target": "Body",
    "pointtarget": "Body",
    "scatterer": "Body",
    "transmitter": "Radar",
    "receiver": "Radar",
    "chirp": "Waveform",
    "fmcw": "Waveform",
    "patchantenna": "CosineAntenna",
    "microdoppler": "spectrogram",
    "fresnel": "Material",
    "noisefigure": "Radar",
    "linkbudget": "Radar.link_budget",
    "pathloss": "specular_paths",
    "kfactor": "specular_paths",
    "delayspread": "Paths",
    "powerdelayprofile": "Result.profile",
    "pdp": "Result.profile",
    "kalman": "raychan.dynamics.kalman",
    "laser": "raychan.sensors.laser",
    "lidar": "raychan.sensors.laser",
}
"""Names that people try, in small letters without underscores, and what stands here, or in a module, for them."""


def _hint(name: str) -> str:
    """Return a question that names the nearest public name, or ''."""
    if name.startswith("_"):  # Python itself asks for these
        return ""
    from difflib import get_close_matches

    small = {known.lower(): known for known in _HOME}
    near = _TRIED.get(name.lower().replace("_", "")) or next(
        (small[x] for x in get_close_matches(name.lower(), small, n=1)), ""
    )
    return f"; did you mean {near!r}?" if near else ""


def _load(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("raychan")
    if name not in _HOME:
        raise AttributeError(f"module 'raychan' has no attribute {name!r}{_hint(name)}")
    from importlib import import_module

    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


if not TYPE_CHECKING:
    __getattr__ = _load  # type checkers know the names, and that there are no others


def __dir__() -> list[str]:
    return sorted(__all__)
