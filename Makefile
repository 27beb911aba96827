# Each target makes what it needs of the environment from constraints.txt, then runs. Another Python: make PYTHON=python3.13

SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(shell for p in python3.12 python3.13 python3.11 python3 python; do \
	$$p -c '$(SUPPORTED)' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install -q --disable-pip-version-check --no-compile -c constraints.txt
RUNTIME := $(VENV)/made-to-run
ENVIRONMENT := $(VENV)/made-from-constraints
DOCS := $(VENV)/made-for-docs
MUTANTS := $(VENV)/made-for-mutants
DEMO ?=
DRAWN ?=
TESTS ?=

.PHONY: demo test test-slow lint types docs mutants clean

demo: $(RUNTIME)
	$(BIN)/flockscope demo $(DEMO)
	@command -v flockscope > /dev/null || echo "for the command flockscope: source $(BIN)/activate"

test: $(ENVIRONMENT)
	$(BIN)/python -m pytest -q -n auto --durations=5 -m "not slow" $(TESTS)

test-slow: $(ENVIRONMENT)
	$(BIN)/python -m pytest -q -n auto --durations=5 -m slow $(TESTS)

lint: $(ENVIRONMENT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(ENVIRONMENT)
	$(BIN)/mypy
	$(BIN)/python -m benchmarks snippets

docs: $(DOCS)
	$(BIN)/sphinx-build -q -W --keep-going -E -b html -d build/doctrees docs build/docs
	@echo "build/docs/index.html"

mutants: $(MUTANTS)
	$(BIN)/python -m benchmarks mutants $(DRAWN)

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .hypothesis flockscope-demo
	find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +

# Made anew whenever what it is made from changes; whole or not there, because the last line makes it current.
$(RUNTIME): pyproject.toml constraints.txt
	@$(PYTHON) -c '$(SUPPORTED)' || { echo "Python 3.11, 3.12 or 3.13 is needed: make PYTHON=/path/to/python" >&2; exit 2; }
	rm -rf $(VENV)
	$(PYTHON) -m venv $(VENV)
	$(PIP) setuptools
	$(PIP) --no-build-isolation -e ".[report,tune]"
	@touch $@

$(ENVIRONMENT): $(RUNTIME)
	$(PIP) --no-build-isolation -e ".[dev]"
	$(PIP) --no-deps trackeval
	@touch $@

$(DOCS): $(ENVIRONMENT)
	$(PIP) --no-build-isolation -e ".[docs]"
	@touch $@

$(MUTANTS): $(ENVIRONMENT)
	$(PIP) --no-build-isolation -e ".[mutants]"
	@touch $@
