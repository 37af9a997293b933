"""Samples: from paths to the dechirped signal and the power-delay profile."""
