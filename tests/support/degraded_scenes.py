"""Scenes with impairments, air, interferers and clutter: one radar, and an array with all of it."""

SCENE = """
[radar]
position = [0.0, 0.0, 0.5]
power_dbm = 12.0
noise_temperature_k = 40.0
[radar.waveform]
bandwidth_mhz = 500.0
chirp_us = 20.0
repetition_us = 25.0
chirps = 32
samples = 256
[processing]
min_snr_db = 12.0
[[bodies]]
name = "target"
shape = "sphere"
params = { radius = 0.3 }
position = [30.0, 2.0, 0.5]
rcs_dbsm = 10.0
[[bodies]]
name = "road"
shape = "ground"
"""
BAD = """
[radar.impairments]
chirp_error_us_khz = [[0.0, 0.0], [20.0, 30.0]]
phase_noise_hz_dbc = [[1e4, -80.0], [1e6, -95.0]]
adc_bits = 10
adc_full_scale_dbm = -50.0
iq_gain_db = 0.2
iq_phase_deg = 1.0
dc_offset_dbm = -90.0
"""
AIR = """
[atmosphere]
rain_mmh = 50.0
"""
OTHER = """
[[interferers]]
name = "truck"
position = [40.0, -2.0, 0.6]
yaw_deg = 180.0
power_dbm = 12.0
start_us = 0.05
[interferers.waveform]
bandwidth_mhz = 500.0
chirp_us = 20.0
repetition_us = 25.0
chirps = 32
"""
EVERYTHING = """
[radar]
position = [0.0, 0.0, 1.0]
power_dbm = 20.0
noise_figure_db = 10.0
noise_temperature_k = 150.0
elements_mm = [{receivers}]
tx_elements_mm = [[0.0, -7.787, 0.0], [0.0, 7.787, 0.0]]
multiplexing = "tdm"
[radar.waveform]
bandwidth_mhz = 300.0
chirp_us = 20.0
repetition_us = 25.0
chirps = 64
samples = 128
[radar.impairments]
phase_noise_hz_dbc = [[1e4, -75.0], [1e6, -95.0]]
adc_bits = 12
adc_full_scale_dbm = -40.0
[atmosphere]
rain_mmh = 20.0
[[interferers]]
name = "oncoming"
position = [45.0, -6.0, 0.8]
yaw_deg = 180.0
power_dbm = 12.0
start_us = 1.0
[interferers.waveform]
bandwidth_mhz = 700.0
chirp_us = 30.0
repetition_us = 37.0
chirps = 40
[materials.tarmac]
eps_r = 5.0
sigma = 0.5
[materials.tarmac.diffuse]
law = "gamma"
level_db = -18.0
[[bodies]]
name = "road"
shape = "ground"
material = "tarmac"
[[bodies]]
name = "post"
shape = "sphere"
params = {{ radius = 0.2 }}
position = [18.0, 6.0, 1.0]
rcs_dbsm = 25.0
[[bodies]]
name = "walker"
shape = "sphere"
params = {{ radius = 0.2 }}
position = [10.0, -2.0, 1.0]
rcs_dbsm = 0.0
swerling = 1
velocity_mps = [1.5, 0.0, 0.0]
""".format(receivers=", ".join(f"[0.0, {1.9467 * (k - 3.5):.4f}, 0.0]" for k in range(8)))
