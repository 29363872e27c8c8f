# Needs python3 (3.11 or newer, with venv) and make; everything else goes into $(VENV).
PYTHON ?= python3
VENV ?= .venv
OUT ?= out
SAMPLE ?= samples/hull_seam.mod
FORCE ?= 200,-200,-200

BIN := $(VENV)/bin
# One thread for linear algebra: the arrays are small and threads only get in each other's way.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
# The tests start many processes: each would compile the package anew where Python is told to keep no bytecode.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test lint pytest bench docs clean

RESULT := $(OUT)/$(notdir $(SAMPLE))

demo: $(VENV)/.installed  ## Convert a sample and show the result.
	@mkdir -p $(OUT)
	@$(BIN)/postproc compensate $(SAMPLE) --force $(FORCE) --report $(RESULT:.mod=.html) -o $(RESULT)
	@echo
	@sed -n '/! postproc/,/twice/p' $(RESULT)
	@echo
	@echo "program      $(SAMPLE)"
	@echo "compensated  $(RESULT)"
	@echo "report       $(RESULT:.mod=.html)"
	@echo "compare      $(BIN)/postproc diff $(SAMPLE) $(RESULT)"

test: $(VENV)/.installed-dev  ## Lint, types and all tests, side by side.
	@$(MAKE) --no-print-directory -j2 lint pytest

pytest: $(VENV)/.installed-dev
	$(BIN)/pytest -q -n auto --dist worksteal --durations=20

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(VENV)/.installed-dev  ## Speed and memory, written to docs/benchmarks.md; AGAINST=FILE compares with a saved run.
	$(BIN)/python -m tests.bench.speed --write docs/benchmarks.md --json $(OUT)/bench.json $(if $(AGAINST),--against $(AGAINST))

docs: $(VENV)/.installed-docs  ## The documentation; warnings are errors.
	$(BIN)/sphinx-build -j auto -W -q docs docs/_build/html
	@echo "open docs/_build/html/index.html"

clean:
	rm -rf $(VENV) $(OUT) docs/_build docs/_generated

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "postproc needs Python 3.11 or newer; set PYTHON=python3.11")'
	@echo "Setting up $(VENV): a few minutes the first time"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: pyproject.toml | $(VENV)/bin/python
	@$(BIN)/python -m pip install -q --disable-pip-version-check -e .
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(VENV)/bin/python
	@$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[dev]'
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-docs: pyproject.toml | $(VENV)/bin/python
	@$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[docs]'
	@touch $@ $(VENV)/.installed
