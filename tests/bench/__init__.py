"""Benchmarks: what the simulator costs against what the machine could do. `make bench`; not part of the tests."""
