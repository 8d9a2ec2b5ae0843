# Everything a newcomer and the gate need. PYTHON=python3.12 make demo  uses another interpreter.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= demo_out
INSTALLED := $(VENV)/.installed

.PHONY: help install demo test test-slow bench clean

help:
	@echo "make demo       map a simulated office into $(OUT)/"
	@echo "make test       ruff, mypy --strict, pytest"
	@echo "make test-slow  the tests that take longer than 20 s"
	@echo "make bench      accuracy and time on the SICK logs in \$$GLASSSLAM_DATA"
	@echo "make clean      remove what the above made"

install: $(INSTALLED)

$(INSTALLED): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "glassslam needs Python 3.11 or newer; '$(PYTHON)' is not (try: make PYTHON=python3.12)"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

demo: $(INSTALLED)
	$(BIN)/glassslam demo -o $(OUT)

test: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict
	$(BIN)/pytest

test-slow: $(INSTALLED)
	$(BIN)/pytest -m slow

bench: $(INSTALLED)
	$(BIN)/python tools/benchmark.py

clean:
	rm -rf $(VENV) $(OUT) build *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .benchmarks
	find glassslam detectors tests tools -name __pycache__ -type d -prune -exec rm -rf {} +
