# Two commands on a fresh machine with Python 3.11+, venv and make:
#   make demo   calibrates two thrusters on the simulated bench, over real bytes
#   make test   every check and every test
# and one that takes a night (make prove-short: minutes):
#   make prove  the blind proof of the diagnosis, resumable, with its report in build/prove
# and one that takes an hour and a half on a machine that does nothing else:
#   make reliability  the 35 promises of docs/reliability.md, measured as often as they say
PYTHON ?= python3
VENV := .venv
# one case each: some effects at each strength, the same taken out of the catalogue, some that are in none, lies, noise
SHORT := */asymmetry */dead_band */heating */motor_lag */zero_offset outside fault pair/any/0 pair/any/1 field/2_effects difference/nothing/0 bench/nothing/0 bench/plain:dead_band/0 clean/*/0 clean/*/1
BIN := $(VENV)/bin
MEASURED := $(CURDIR)/build/reliability.jsonl
TESTING := THRUSTER_RIG_CI=1 THRUSTER_RIG_MEASURED=$(MEASURED)

.PHONY: demo test check lint types imports wheel reliability prove prove-short clean

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

test: $(VENV)/.test
	$(MAKE) --no-print-directory --output-sync -j 2 types wheel lint imports
	rm -f $(MEASURED)
	$(TESTING) $(BIN)/python -m pytest -n 2 --dist worksteal -m "not alone" --cov --cov-report= --durations=15
	$(TESTING) $(BIN)/python -m pytest -n 2 --dist worksteal -m alone --reruns 3 --only-rerun 'did not get where the test begins' --cov --cov-append --cov-report=term:skip-covered --durations=15
	$(BIN)/python tests/coverage_floor.py
	$(BIN)/python benchmarks/controller/reliability.py --collect
	THRUSTER_RIG_CI=1 $(BIN)/python tests/newest_python.py

reliability: $(VENV)/.test
	$(BIN)/python benchmarks/controller/reliability.py

wheel: $(VENV)/.test
	rm -rf build/wheel && mkdir -p build
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .
	$(PYTHON) -m venv --clear build/clean
	build/clean/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt build/wheel/*.whl
	cd build && clean/bin/rig --help && rm -rf first && clean/bin/rig init first

prove: $(VENV)/.demo
	$(BIN)/rig prove --store build/prove --report build/prove/report.html --json build/prove/report.json

prove-short: $(VENV)/.demo
	$(BIN)/rig prove --store build/prove-short --seeds 1 $(foreach part,$(SHORT),--only '$(part)') \
		--report build/prove-short/report.html --json build/prove-short/report.json

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage
