"""Runs: from a scene to a result, single bodies, sequences, and what is stored of them."""
