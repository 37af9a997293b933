"""The receiver after sampling: range-Doppler map, CFAR, detection, direction of arrival. It never sees the scene."""
