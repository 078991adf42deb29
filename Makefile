# README's two commands: `make demo` and `make test`. Everything happens in .venv and build/.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := pyproject.toml $(shell git ls-files '*.py' 2>/dev/null | grep -v '^tests/' | grep -v '^benchmarks/')

.PHONY: demo test test-long lint bench docs clean

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -qq --upgrade pip

$(VENV)/installed: $(BIN)/python $(SOURCES)
	rm -rf build/lib
	$(BIN)/python -m pip install -qq .
	touch $@

$(VENV)/installed-dev: $(BIN)/python $(SOURCES)
	rm -rf build/lib
	$(BIN)/python -m pip install -qq ".[dev]"
	touch $@ $(VENV)/installed

demo: $(VENV)/installed
	$(BIN)/attlog run data/demo_flight.tlog -o build/demo/demo_flight.mcap --force

test: $(VENV)/installed-dev
	$(BIN)/python -m pytest -c tests/pytest.ini tests

test-long: $(VENV)/installed-dev
	$(BIN)/python -m pytest -c tests/pytest.ini tests -m long

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	cd build && ../$(BIN)/mypy --config-file ../pyproject.toml -p attlog

bench: $(BIN)/python
	rm -rf build/lib
	$(BIN)/python -m pip install -qq ".[peers]"
	$(BIN)/python -m benchmarks

docs: $(BIN)/python
	rm -rf build/lib
	$(BIN)/python -m pip install -qq ".[docs]"
	$(BIN)/mkdocs build --strict

clean:
	rm -rf build .venv *.egg-info
