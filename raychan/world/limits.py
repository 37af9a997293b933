"""Physical limits of numbers with unit and reason, the same for scene files, options and Python arguments.

A number beyond them is a mistake (a wrong unit, a digit too many) or asks for physics that is not modelled.
"""

from __future__ import annotations

from raychan.limits import BANDWIDTH_MHZ as BANDWIDTH_MHZ
from raychan.limits import CARRIER_GHZ as CARRIER_GHZ
from raychan.limits import CELSIUS as CELSIUS
from raychan.limits import CROSS_DB as CROSS_DB
from raychan.limits import DIFFUSE_DB as DIFFUSE_DB
from raychan.limits import EXPONENT as EXPONENT
from raychan.limits import FOG_GM3 as FOG_GM3
from raychan.limits import FREQUENCY as FREQUENCY
from raychan.limits import K_SHAPE as K_SHAPE
from raychan.limits import KELVIN as KELVIN
from raychan.limits import LOSS_DB as LOSS_DB
from raychan.limits import NOISE_DB as NOISE_DB
from raychan.limits import PRESSURE_HPA as PRESSURE_HPA
from raychan.limits import RAIN_MMH as RAIN_MMH
from raychan.limits import RAMP_US as RAMP_US
from raychan.limits import SAMPLES as SAMPLES
from raychan.limits import TEXTURE_M as TEXTURE_M
from raychan.limits import VAPOUR_GM3 as VAPOUR_GM3
from raychan.limits import Limit as Limit

LENGTH = Limit(0.0, 1e6, "m", "a scene is no wider than a radar's horizon", above=True)
PLACE = Limit(-1e6, 1e6, "m", "a scene is no wider than a radar's horizon; count from an origin near it")
WIDTH = Limit(0.0, 1e4, "m", "float32 rays do not tell the facets of a wider body apart; is it the unit, as mm?")
SAG = Limit(1e-6, 10.0, "m", "a facet finer than a micrometre is flat at any wavelength allowed")
WALK = Limit(0.0, 30.0, "m/s", "nobody walks or cycles faster", above=True)
PHASE = Limit(0.0, 1e6, "cycles", "the share of a cycle that is done, and whole ones before")
HOOPS = Limit(1, 1000, "", "a rack of so many hoops")
OFFSET_MM = Limit(-1e3, 1e3, "mm", "the elements of one array stand within a metre of its phase centre")
SLOTS = Limit(2, 64, "", "Doppler slots, at least the transmitters")
SPEED = Limit(-1e5, 1e5, "m/s", "range rates are of second order in v/c, and nothing here is faster than a spacecraft")
ANGLE = Limit(-3600.0, 3600.0, "deg", "ten turns are more than any pose needs")
CREASE = Limit(0.0, 180.0, "deg", "faces fold by at most half a turn")
BEAM = Limit(0.1, 360.0, "deg", "no antenna of a vehicle or ship has a narrower beam")
TURN = Limit(-1e7, 1e7, "deg/s", "no rotor turns faster than 1.6 million times a minute")

CHIRPS = Limit(1, 1 << 20, "", "no radar's frame has more ramps")
PAD = Limit(1, 64, "", "1 pads nothing; more than 64 only draws the same map finer")
CELLS = Limit(0, 1000, "cells", "cells on each side of the one under test")

POWER_DBM = Limit(-100.0, 100.0, "dBm", "from less than a receiver's noise to ten megawatts")
LEVEL_DBM = Limit(-200.0, 100.0, "dBm", "from less than a map cell's noise to ten megawatts")
INSTANT_US = Limit(-1e6, 1e6, "us", "a ramp lasts at most a second")
START_US = Limit(-1e7, 1e7, "us", "ten seconds are more than any frame")
DEVIATION_KHZ = Limit(-1e8, 1e8, "kHz", "a ramp that errs by more than 100 GHz is another ramp")
OFFSET_HZ = Limit(0.0, 1e12, "Hz", "an offset from the carrier", above=True)
DBC_HZ = Limit(-250.0, 0.0, "dBc/Hz", "below, quantum noise is higher; above, noise is above the carrier")
IMBALANCE_DB = Limit(-20.0, 20.0, "dB", "beyond, a mixer has one branch")
BITS = Limit(1, 24, "", "converters of more bits are not made")
RCS_DBSM = Limit(-100.0, 100.0, "dBsm", "from a grain of dust to more than any ship seen broadside")
SWERLING = Limit(0, 4, "", "0 steady, 1 and 3 from frame to frame, 2 and 4 from chirp to chirp")
GAIN_DBI = Limit(-60.0, 80.0, "dBi", "from leakage to the largest dishes")
LEVEL_DB = Limit(-400.0, 400.0, "dB", "levels beyond are not physical")
WAVELENGTHS = Limit(0.01, 100.0, "wavelengths", "closer elements couple; farther ones make no array")
ELEMENTS = Limit(1, 256, "", "a row of at most 256 elements")
ROW_WAVELENGTHS = 128.0
"""Most that a row of elements may span: its pattern is integrated over the sphere, to the square of this."""

PFA = Limit(1e-15, 0.5, "", "a false alarm probability that training cells can resolve")
SNR_DB = Limit(-100.0, 300.0, "dB", "a level over noise")
TOLERANCE_DB = Limit(1e-3, 40.0, "dB", "below, rounding shows; above, an error says nothing")
BOUNCES = Limit(1, 12, "", "each bounce costs more and brings less; paths hold 12")
LAYERS = Limit(0, 16, "", "paths hold 16 layers")
TRACINGS = Limit(1, 4096, "", "each is a tracing of its own")
RAYS = Limit(1, 1_000_000_000_000, "", "a week of one core casts some 1e12")
RUN_SECONDS = Limit(0.0, 1e7, "s", "a run lasts at most some months")
MEMORY_MB = Limit(1.0, 1e7, "MB", "no machine has more than 10 TB")
FRAMES = Limit(1, 100_000, "", "each is a run and a folder of its own")
SECONDS = Limit(1e-4, 600.0, "s", "a spectrogram of ten minutes is thousands of tracings")
TRACED = Limit(1.0, 1e5, "1/s", "tracings a second")
RATE_STEP = Limit(1e-3, 100.0, "m/s", "resolution of a spectrogram in range rate", above=True)
CELL_RANGE = Limit(0.0, 1e6, "m", "range cells begin at the radar, and a scene is no wider than its horizon")
LISTED = Limit(0, 1_000_000, "", "rows of a table; 0 lists none")
INTERVAL = Limit(1e-9, 1e6, "s", "from frame to frame")
LATER = Limit(-1e11, 1e11, "s", "as far as the last of the most frames at the longest interval")
SEED = Limit(0, (1 << 63) - 1, "", "seeds are whole numbers of 63 bits")

EPS_R = Limit(1.0, 1e4, "", "of passive materials: 1 is vacuum, 80 water")
SIGMA = Limit(0.0, 1e9, "S/m", "of passive materials: silver has 6e7")
THICKNESS_MM = Limit(1e-7, 1e4, "mm", "no atom is thinner; thicker is opaque: leave the key out")
ROUGHNESS_MM = Limit(0.0, 1e3, "mm", "rms height of a surface, not of a landscape")
SCALE = Limit(1e-9, 1e9, "", "a factor on a mesh's size", above=True)

VOYAGE_S = Limit(0.0, 1e5, "s", "a day under way", above=True)
INSTANT_S = Limit(0.0, 1e5, "s", "a day under way")
SHIP_MPS = Limit(0.5, 60.0, "m/s", "below, no rudder steers; above, no ship of these models goes")
HEADING_DEG = Limit(-36000.0, 36000.0, "deg", "a hundred turns; a full circle to starboard is 360 more")
RUDDER_DEG = Limit(0.0, 90.0, "deg", "across the flow a rudder only brakes", above=True)
RUDDER_DPS = Limit(0.0, 360.0, "deg/s", "a rudder turns at some degrees a second", above=True)
TURN_DPS = Limit(0.0, 90.0, "deg/s", "no ship turns faster", above=True)
WEIGHT = Limit(0.0, 1e12, "", "a weight of LQR is not negative")
GAIN = Limit(-1e6, 1e6, "", "rudder angle [rad] per state in SI")
LOOP_RATE = Limit(1e-4, 10.0, "rad/s", "no ship answers its rudder faster")
DAMPING = Limit(0.1, 10.0, "", "below, the ship swings about its course")
DEVIATION = Limit(0.0, 1e3, "", "a standard deviation")
STRENGTH = Limit(0.0, 1e3, "", "without some disturbance a filter has no steady state", above=True)
REFLECTIVITY = Limit(0.0, 100.0, "", "1 is a white diffuse surface, reflectors have 20")
BEAM_RANGE = Limit(0.0, 1e6, "m", "range of a laser scanner: beyond, nothing is above the horizon", above=True)
WAVE_HEIGHT_M = Limit(0.0, 20.0, "m", "significant height: 0.5 is a slight sea, 4 a rough one, 14 a phenomenal one")
WAVE_PERIOD_S = Limit(0.5, 30.0, "s", "shorter waves are ripples, longer ones tides")
PEAK = Limit(1.0, 7.0, "", "1 is a fully developed sea, 3.3 the mean of JONSWAP")
DIVERGENCE_MRAD = Limit(0.0, 500.0, "mrad", "wider, a beam is no beam")
SPOT_MM = Limit(0.0, 1000.0, "mm", "wider than any scanner's window")
RINGS = Limit(1, 32, "", "rings of 6, 12, ... sub-rays; 8 are 217 rays a beam, 32 are 3,169")
MERGE_M = Limit(0.0, 100.0, "m", "half the length of a pulse; 1 ns is 0.15 m")
SCAN_STEP_DEG = Limit(0.25, 1.0, "deg", "steps are 1, 0.5 or 0.25 deg")
FAN_DEG = Limit(0.0, 360.0, "deg", "a mirror turns once round", above=True)
MIRROR_HZ = Limit(1.0, 1e4, "Hz", "turns of the mirror a second")
DRAWS = Limit(2, 10_000, "", "each is a run of its own")
TURN_DEG = Limit(0.0, 45.0, "deg", "a tolerance, not another pose")
SHIFT_MM = Limit(0.0, 1e4, "mm", "a tolerance, not another place")
