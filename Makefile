# Each target sets itself up: only python3 (3.11 or newer) and make are needed beforehand.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
# Threads of small matrix products only wait for each other where tests run on every core.
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: install demo wheel test test-slow lint benchmark clean

install: $(READY)

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "aerosid needs Python 3.11 or newer: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	-$(BIN)/python -m compileall -q aerosid  # as pip does with what it installs; an editable install leaves it out
	-$(BIN)/aerosid warm-up --sample
	@touch $@

demo: $(READY)
	$(BIN)/aerosid close-loop flight_data/light_transport_doublet.csv --aircraft aircraft_models/light_transport.toml \
		--validate flight_data/light_transport_3211.csv --out reports/demo

# A wheel with its compiled kernels: nothing is compiled at first use on the same Python, numba and processor.
wheel: $(READY)
	rm -rf build/kernels
	AEROSID_CACHE_DIR=build/kernels $(BIN)/aerosid warm-up
	AEROSID_WHEEL_KERNELS=build/kernels $(BIN)/python -m build --wheel

test: $(READY)
	$(BIN)/python -m pytest -q -n 2 --dist worksteal -m "not slow"

test-slow: $(READY)
	$(BIN)/python -m pytest -q -m slow

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# What is compared with is optional: a tool that cannot be installed gives a row that says so.
benchmark: $(READY)
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,compare]'
	$(BIN)/python -m benchmarks $(if $(PAGE),--page $(PAGE)) $(if $(REPORT),--report $(REPORT)) $(if $(MOST),--most $(MOST))

clean:
	rm -rf build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find aerosid tests -name '*.nb[ic]' -delete
