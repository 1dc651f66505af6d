# make room: set up, author a sample and show it.   make test: set up, lint, types, tests.
PYTHON ?= python3.11
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: help room test lint types clients benchmarks schema clean

help:
	@grep -E '^# ' Makefile | cut -c3-

$(STAMP): pyproject.toml setup.py constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check torch -c constraints.txt
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	touch $@

room: $(STAMP)
	$(BIN)/echousd new out/bedroom.usda --from samples/bedroom.yaml --force
	$(BIN)/echousd graph out/bedroom.usda

lint: $(STAMP)
	$(BIN)/ruff check .

types: $(STAMP)
	$(BIN)/mypy

test: lint types
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not clients"

clean:
	rm -rf $(VENV) out build *.egg-info
