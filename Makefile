# make demo: a street becomes a range-Doppler map.   make test: lint, format, types, tests.   make bench: speed.
# PYTHON is the interpreter that makes the environment; anything from 3.11 on will do.
PYTHON ?= python3
VENV ?= .venv
FUZZ ?= --minutes 30
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
# Tests of the kernels: `make test` runs them with bounds checked and no second time without; the rest of the suite with
# bounds checked: make test-bounds. No test that is skipped with bounds checked is among them. Less optimised code
# is compiled in a seventh less time, and runs these as fast.
BOUNDS := $(addprefix tests/,em house/test_bounds.py compile/test_code_cache.py processing/test_range_doppler.py processing/test_fold_kernels.py \
	processing/test_climb_kernels.py processing/test_rival_sets.py processing/test_near_field.py signal/test_arrays.py signal/test_drifting_sources.py signal/test_fronts.py signal/test_nufft.py \
	world/test_shapes.py world/test_ray_caster.py world/test_contractions.py world/test_vertex_normals.py run/test_provenance.py run/test_preview_bounds.py channel/test_corner_places.py channel/test_filon.py \
	channel/test_layers_over_a_footprint.py channel/test_fields_over_a_footprint.py tracing/test_landing_on_curves.py tracing/test_contradicted_edges.py \
	run/test_narrow_beams.py tracing/test_ways.py \
	$(addprefix tracing/test_,edge_diffraction.py image_paths.py occluders.py subdivide.py visibility.py))
# Tests of the kernels that are cheap enough as plain Python; marked `compiled`: what is not, each with its reason.
NOJIT := $(addprefix tests/,em house/test_bounds.py processing/test_range_doppler.py \
	$(addprefix tracing/test_,edge_diffraction.py occluders.py subdivide.py visibility.py))
PYTEST := $(BIN)/pytest -n auto --maxprocesses 4 --dist loadfile

.PHONY: help demo test types suite test-bounds test-nojit coverage fuzz signatures bench docs clean

help:
	@echo "make demo   install into $(VENV) and run scenes/urban.toml into out/urban"
	@echo "make test   ruff, ruff format, mypy, pytest; of these the three scenes and the kernels' tests with bounds checked"
	@echo "make test-bounds   all tests with the bounds of every array in compiled code checked"
	@echo "make test-nojit   the kernels' tests with the compiler off, where that takes no minutes"
	@echo "make coverage   which lines tests reach, the kernels' as plain Python (some minutes)"
	@echo "make fuzz   random scene files, meshes and flags for half an hour (FUZZ=--help: more)"
	@echo "make signatures   list anew what a cold run compiles, for its second process (some minutes)"
	@echo "make bench  speed as ratios, memory; a table and out/bench.json (BENCH=--quick: a few minutes; BENCH=--help)"
	@echo "make docs   the pages of docs/ and the API reference into out/docs; warnings are errors"
	@echo "make clean  remove $(VENV), out and caches"

demo: $(VENV)/.installed
	$(BIN)/raychan run scenes/urban.toml --out out/urban

test: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(MAKE) --no-print-directory -j2 types suite
	NUMBA_OPT=1 NUMBA_BOUNDSCHECK=1 $(PYTEST) $(BOUNDS)

# Side by side: tests wait for each other's compiling and for what they start, types take one core.
types: $(VENV)/.installed-dev
	$(BIN)/mypy

suite: $(VENV)/.installed-dev
	$(PYTEST) $(addprefix --ignore=,$(BOUNDS))

test-bounds: $(VENV)/.installed-dev
	NUMBA_BOUNDSCHECK=1 $(PYTEST)

test-nojit: $(VENV)/.installed-dev
	NUMBA_DISABLE_JIT=1 $(PYTEST) $(NOJIT)

# Kernels count where they run as plain Python.
coverage: $(VENV)/.installed-dev
	NUMBA_DISABLE_JIT=1 $(PYTEST) $(NOJIT) --cov --cov-report=
	$(PYTEST) --cov --cov-append --cov-report=term:skip-covered

fuzz: $(VENV)/.installed-dev
	PYTHONPATH=tests $(BIN)/python -m fuzz $(FUZZ)

signatures: $(VENV)/.installed-dev
	PYTHONPATH=tests $(BIN)/python -m signatures

bench: $(VENV)/.installed
	PYTHONPATH=tests $(BIN)/python -m bench $(BENCH)

docs: $(VENV)/.installed-docs
	$(BIN)/python docs/build.py out/docs

# A stamp younger than pyproject.toml says that the environment is up to date.
$(VENV)/.installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-docs: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@ $(VENV)/.installed

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "raychan needs Python 3.11 or newer; say which with: make PYTHON=python3.12" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)

clean:
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
