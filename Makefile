# Two commands on a fresh machine with Python 3.11+, venv and make:
#   make demo   calibrates two thrusters on the simulated bench, over real bytes
#   make test   every check and every test
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test check lint types imports wheel clean

$(VENV)/.demo: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	touch $@

$(VENV)/.test: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	touch $@ $(VENV)/.demo

demo: $(VENV)/.demo
	$(BIN)/python -m sim_devices benches/simulated/world.toml --campaign campaigns/demo.toml

lint: $(VENV)/.test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(VENV)/.test
	$(BIN)/mypy

imports: $(VENV)/.test
	$(BIN)/lint-imports

check: lint types imports

test: check wheel
	THRUSTER_RIG_CI=1 $(BIN)/python -m pytest -n 2 --dist worksteal -m "not alone" --cov --cov-report= --durations=15
	THRUSTER_RIG_CI=1 $(BIN)/python -m pytest -m alone --cov --cov-append --cov-report=term:skip-covered --durations=15
	$(BIN)/python tests/coverage_floor.py

wheel: $(VENV)/.test
	rm -rf build/wheel && mkdir -p build
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .
	$(PYTHON) -m venv --clear build/clean
	build/clean/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt build/wheel/*.whl
	cd build && clean/bin/rig --help

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage
