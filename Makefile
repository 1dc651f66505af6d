# make room: sets up, generates the sample bedroom, says where its picture is.
# make test: sets up, lint, types, tests.
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
	$(BIN)/echousd generate samples/bedroom.usda -o out/bedroom --seed 7

lint: $(STAMP)
	$(BIN)/ruff check .

types: $(STAMP)
	$(BIN)/mypy

test: lint types
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile -m "not clients"

# make clients: opens generated rooms in Blender, three.js, simulators, validators and older OpenUSDs.
clients: $(STAMP)
	$(BIN)/python -m pytest tests/clients -m clients

# make benchmarks: ratios, each printed with what was asked; wants an idle machine and some minutes.
benchmarks: $(STAMP)
	cd benchmarks && for script in compact_budget graph_stage rooms layout_step; do ../$(BIN)/python $$script.py; done

# make schema: the plugin's files, made anew from schemas/schema.usda.
schema: $(STAMP)
	$(BIN)/python -m echousd.schemas.regenerate

clean:
	rm -rf $(VENV) out build *.egg-info
