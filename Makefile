# make room: sets up, generates the sample bedroom, says where its picture is.
# make test: sets up, lint, tests, with the types among them.
PYTHON ?= python3.11
VENV ?= .venv
BIN := $(VENV)/bin
ROOM := $(VENV)/.room
STAMP := $(VENV)/.installed
AUDIT := .audit

.PHONY: help room test quick mutants lint types clients hashes audit benchmarks benchmark eval paper schema clean

help:
	@grep -E '^# make' Makefile | cut -c3-

# What a room needs, then what tests need: simulators, validators, linters.
$(ROOM): pyproject.toml setup.py constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check torch -c constraints.txt
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[render]"
	touch $@

$(STAMP): $(ROOM)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	touch $@

room: $(ROOM)
	$(BIN)/echousd generate samples/bedroom.usda -o out/bedroom --seed 7

lint: $(STAMP)
	$(BIN)/ruff check .

types: $(STAMP)
	$(BIN)/mypy

test: lint
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0 -m "not clients"

# make quick: the tests that answer within a minute, without lint and types.
quick: $(STAMP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0 -m "not clients" --quick -q

# make mutants GROUP=rules: which faults the tests of a group notice (rules, graph, stage, edit, folder, layers).
mutants: $(STAMP)
	$(BIN)/python tests/mutants.py $(GROUP)

# make clients: opens generated rooms in Blender, three.js, simulators, validators and older OpenUSDs.
clients: $(STAMP)
	$(BIN)/python -m pytest tests/clients -m clients

# make hashes: requirements.txt, the hashes of what ships, made anew from constraints.txt.
hashes: $(STAMP)
	$(BIN)/python docs/make_hashes.py

# make audit: known faults of what ships; says so where the database of them cannot be reached.
audit:
	@rm -f $(AUDIT)/found.json
	test -x $(AUDIT)/bin/pip-audit || { $(PYTHON) -m venv $(AUDIT) && $(AUDIT)/bin/pip install --quiet pip-audit; }
	-$(AUDIT)/bin/pip-audit -r requirements.txt --require-hashes --disable-pip --progress-spinner off -f json -o $(AUDIT)/found.json
	@$(AUDIT)/bin/python docs/audited.py $(AUDIT)/found.json

# make benchmarks: ratios, each printed with what was asked; wants an idle machine and some minutes.
benchmarks: $(STAMP)
	cd benchmarks && for script in compact_budget graph_stage rooms; do ../$(BIN)/python $$script.py; done

# make eval: the shipped weights beside chance and plain baselines, report.md, .json and .html in out/eval.
SET ?= generated
eval: $(STAMP)
	$(BIN)/echousd eval suite --against $(SET) --count 24 --workers 2 --force -o out/eval/report

# make paper SGFRONT=DIR: trains the paper preset on SG-FRONT with 3D-FUTURE-SDF in it, and fills our column of the tables.
PAPER ?= out/paper
TRAIN = $(BIN)/echousd train model/recipes/paper.toml --set data=$(SGFRONT) $(SETTINGS)
paper: $(STAMP)
	$(TRAIN) --set stage=paper_vqvae -o $(PAPER)/vqvae
	$(TRAIN) --set 'start=["$(PAPER)/vqvae/weights.safetensors"]' -o $(PAPER)/run
	$(BIN)/echousd eval suite $(PAPER)/run default --against $(SGFRONT) --count 370 $(ASKED) --force -o $(PAPER)/report

# make benchmark: what everything takes, as one table of ratios to the machine's matrix products and memory.
benchmark: $(STAMP)
	cd benchmarks && OMP_NUM_THREADS=1 ../$(BIN)/python summary.py

# make schema: the plugin's files, made anew from schemas/schema.usda.
schema: $(STAMP)
	$(BIN)/python -m echousd.schemas.regenerate

clean:
	rm -rf $(VENV) $(AUDIT) out build *.egg-info
