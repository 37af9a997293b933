"""What `raychan info` tells of a receiver's impairments, of the air, and of interferers."""

from __future__ import annotations

from typing import Any


def impairment_rows(scene: Any) -> list[tuple[str, str]]:
    """Return lines (what, figure) on a scene's receiver, air and interferers; none for an ideal radar alone in a
    vacuum."""
    return _receiver(scene.radar) + _air(scene) + _interferers(scene)


def _receiver(radar: Any) -> list[tuple[str, str]]:
    import numpy as np

    from raychan.signal.converter import image_rejection_db
    from raychan.units import dbm

    given, rate = radar.impairments, radar.waveform.sample_rate
    rows = []
    if given.chirp_error is not None:
        worst = max(abs(f) for _, f in given.chirp_error.table)
        rows.append(("chirp error, largest", f"{1e-3 * worst:.4g} kHz"))
    if given.phase_noise is not None:
        # The far limit of range correlation: twice the phase noise from one sweep to half the sample rate, both sides.
        f = np.geomspace(1.0 / radar.waveform.chirp_duration, 0.5 * rate, 2000)
        level = 10.0 * np.log10(4.0 * np.trapezoid(given.phase_noise.density(f), f))
        rows.append(("phase noise of a far echo, all range cells", f"{level:.1f} dBc"))
    if given.converter is not None:
        adc = given.converter
        floor = float(dbm(adc.noise_power(radar.waveform.complex_sampling)))
        rows.append(("converter", f"{adc.bits} bits, full scale {adc.full_scale_dbm:g} dBm, SNR {adc.snr_db:.1f} dB"))
        rows.append(("quantisation noise; thermal", f"{floor:.1f} dBm; {float(dbm(radar.noise_power)):.1f} dBm"))
    if not given.iq_balanced:
        rejection = image_rejection_db(given.iq_gain_db, given.iq_phase_deg)
        rows.append(("image rejection", f"{rejection:.1f} dB"))
    return rows


def _air(scene: Any) -> list[tuple[str, str]]:
    if scene.atmosphere is None:
        return []
    wave = "V" if scene.radar_table is None else scene.radar_table.polarization
    causes = scene.atmosphere.specific(scene.material_frequency, wave)
    each = ", ".join(f"{name} {loss:.3g}" for name, loss in causes.items())
    far = scene.radar.waveform.unambiguous_range
    both = 2e-3 * far * sum(causes.values())
    return [("air, one way", f"{each} dB/km"), (f"air, both ways to {far:.4g} m", f"{both:.3g} dB")]


def _interferers(scene: Any) -> list[tuple[str, str]]:
    import numpy as np

    rows = []
    own = scene.radar.waveform
    for one in scene.interferers:
        away = float(np.linalg.norm(one.radar.position - scene.radar.position))
        off = abs(one.radar.waveform.slope - own.slope)
        longest = own.chirp_duration
        burst = min(own.sample_rate / off, longest) if off > 0.0 else longest
        rows.append((f"interferer {one.name}", f"at {away:.4g} m; a crossing lasts {1e6 * burst:.3g} us of a ramp"))
    return rows
