"""Studies: sweeps, trade-off of error against time, stability of methods, validation against the papers."""
