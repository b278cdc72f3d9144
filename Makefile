# Every target makes what it needs: with Python 3.11 or newer and make, `make refit` and `make test` work in a fresh clone.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out
# Processes of the tests. Those of one file share one, and with it what it has compiled.
WORKERS ?= 2

.PHONY: refit test lint docs bench frameworks validation clean help
.DEFAULT_GOAL := help

help:
	@echo "make refit   scenes -> ground truth -> fit -> report, into $(OUT)/refit   (ARGS=... adds options)"
	@echo "make test    all gates and tests, these in $(WORKERS) processes   (WORKERS=0: in one; ARGS=... adds options)"
	@echo "make lint    ruff, pyright, import-linter"
	@echo "make docs    HTML documentation into docs/_build"
	@echo "make frameworks   PyTorch and JAX for the tests that need them"
	@echo "make bench   benchmarks: ratios from interleaved runs, into $(OUT)/bench   (ARGS=--quick: two minutes)"

refit: $(VENV)/.installed
	$(BIN)/gtao refit -o $(OUT)/refit $(ARGS)

test: lint
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile $(ARGS)

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/pyright

docs: $(VENV)/.installed-dev
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

bench: $(VENV)/.installed-bench
	$(BIN)/python -m tests.bench -o $(OUT)/bench $(ARGS)

validation: $(VENV)/.installed-dev
	$(BIN)/python docs/generate.py

frameworks: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[torch,jax]'

clean:
	rm -rf $(OUT) docs/_build build dist .pytest_cache .ruff_cache

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "gtao needs Python 3.11 or newer: make PYTHON=/path/to/python3.11 ..."; exit 2; }
	@$(PYTHON) -m venv $(VENV) \
		|| { rm -rf $(VENV); echo "Python's venv module is incomplete; on Debian: apt-get install python3-venv"; exit 2; }

$(VENV)/.installed: $(BIN)/python pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[llvm]'
	@touch $@

$(VENV)/.installed-dev: $(BIN)/python pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $(VENV)/.installed $@

$(VENV)/.installed-bench: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	@touch $@
