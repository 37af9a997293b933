"""Radars: antennas and their patterns, waveforms, windows."""
