# What a person types here: make demo, make test. Everything else is a part of these, or upkeep.
# Needs make and Python 3.11 or newer; the environment goes to .venv, its versions are those of constraints.txt.

PYTHON ?= python3
VENV ?= .venv
DEMO ?= demo
JOBS ?= 2
PYTEST_ARGS ?=

BIN := $(VENV)/bin
PY := $(BIN)/python
RUNTIME := $(VENV)/.installed
TOOLS := $(VENV)/.installed-dev

# A sourced ROS workspace puts its packages, and pytest plugins with them, in front of ours: keep them out.
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP MYPYPATH PYTEST_PLUGINS
export PYTHONNOUSERSITE := 1
export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
# The workers of pytest share the processors: threads of linear algebra would wait for each other.
export OPENBLAS_NUM_THREADS := 1
PYTEST := $(PY) -m pytest -p xdist.plugin -p pytest_timeout -p _hypothesis_pytestplugin

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test lint types imports check-docs check-replay unit slow fuzz shell docs docs-commands figures bench bench-gap lock clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1	/p' $(firstword $(MAKEFILE_LIST)) | expand -t 14

demo: $(RUNTIME) ## write the paper's acceleration log, analyse it, say how to look at it
	@mkdir -p $(DEMO)
	$(BIN)/wmr-replay synth paper-acceleration --out $(DEMO)/paper-acceleration.mcap
	$(BIN)/wmr-replay run $(DEMO)/paper-acceleration.mcap --out $(DEMO)
	@echo "command   source $(BIN)/activate, or make shell; then wmr-replay --help"

shell: $(RUNTIME) ## a shell in which wmr-replay and rerun are found; exit leaves it
	@VIRTUAL_ENV="$(abspath $(VENV))" PATH="$(abspath $(BIN)):$$PATH" "$${SHELL:-/bin/sh}"

test: lint types imports check-docs check-replay unit ## lint, type-check, build the docs, run the tests but for the slow ones

lint: $(TOOLS) ## ruff: rules and format
	$(PY) -m ruff check
	$(PY) -m ruff format --check

types: $(TOOLS) ## mypy, strict
	$(PY) -m mypy

imports: $(TOOLS) ## who may import whom
	$(BIN)/lint-imports

SPHINX := $(PY) -m sphinx --quiet --fail-on-warning --keep-going --fresh-env --write-all --builder html
check-docs: $(TOOLS)
	$(SPHINX) -d $(VENV)/doctrees docs $(VENV)/site

REFERENCES := tests/references
REPLAYED := $(VENV)/replayed
check-replay: $(TOOLS) ## replay the reference logs: has any answer changed?
	$(BIN)/wmr-replay suite $(REFERENCES)/suite.toml --out $(REPLAYED) --jobs $(JOBS)
	$(BIN)/wmr-replay check $(REFERENCES) $(REPLAYED) --criteria $(REFERENCES)/criteria.toml --junit $(REPLAYED)/report.xml

unit: $(TOOLS) ## pytest alone, but for what is slow; PYTEST_ARGS="tests/schemas -x" narrows it down
	$(PYTEST) -n $(JOBS) -m "not slow" $(PYTEST_ARGS)

slow: $(TOOLS) ## the tests that take longest: the pages' commands, long logs, hostile ones
	$(PYTEST) -n $(JOBS) -m slow $(PYTEST_ARGS)

SECONDS ?= 600
fuzz: $(TOOLS) ## change logs, definitions and messages at random for SECONDS; what fails joins the stored inputs
	$(PY) tests/replay/hostile/fuzz.py --seconds $(SECONDS)

docs: $(TOOLS) ## the documentation, into site/
	$(SPHINX) -d $(VENV)/doctrees docs site
	@echo "open site/index.html"

PAGES ?=
docs-commands: $(TOOLS) ## run every block of commands and Python of every page: minutes, for the night; PAGES=docs/ci.md runs one
	$(PY) docs/run_commands.py $(PAGES)

BENCH ?= differentiator ingest first_use latency
bench: $(TOOLS) ## speed and accuracy beside peers, which it installs; BENCH=ingest runs one of bench/
	$(INSTALL) --no-build-isolation --editable '.[bench]'
	$(foreach name,$(BENCH),$(PY) bench/$(name).py &&) true

CASES ?= all
bench-gap: $(TOOLS) ## how well gap names hidden effects: hours, carried on where it stopped; CASES=quick is a look
	$(INSTALL) --no-build-isolation --editable '.[bench]'
	$(PY) bench/gap.py --cases $(CASES) --jobs $(JOBS)
	$(PY) bench/gap.py --baselines --jobs $(JOBS)
	$(PY) bench/gap.py --report

figures: $(TOOLS) ## the paper's figures 3 to 6 and the notebook's page, into docs
	$(PY) docs/make_paper_figures.py
	$(PY) docs/make_notebook.py
	$(PY) docs/make_terminal_pictures.py

lock: ## resolve constraints.txt anew; UPGRADE=1 takes the newest versions (needs uv)
	uv pip compile --universal --python-version 3.11 --all-extras --no-header --no-annotate \
	    $(if $(UPGRADE),--upgrade) --quiet --output-file constraints.txt pyproject.toml

clean: ## remove the environment and everything made in it
	rm -rf $(VENV) $(DEMO) site dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find schemas synth replay tests docs -name __pycache__ -type d -prune -exec rm -rf {} +

# --- environment -------------------------------------------------------------------------------------------

define TOO_OLD
$(1) is missing or older than Python 3.11. Either name a newer one,
    make PYTHON=/path/to/python3.11 $(MAKECMDGOALS)
or let uv bring one:
    uv venv --seed --python 3.12 $(VENV) && make $(MAKECMDGOALS)
endef
export NO_VENV := $(PYTHON) has no working venv module (Debian, Ubuntu: apt install python3-venv)
export OLD_PYTHON := $(call TOO_OLD,$(PYTHON))
export OLD_VENV := $(call TOO_OLD,$(PY))
RECENT := -c 'import sys; sys.exit(sys.version_info < (3, 11))'
INSTALL := $(PY) -m pip install --quiet --constraint constraints.txt

$(PY):
	@$(PYTHON) $(RECENT) 2>/dev/null || { echo "$$OLD_PYTHON" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "$$NO_VENV" >&2; exit 1; }

$(RUNTIME): pyproject.toml constraints.txt | $(PY)
	@$(PY) $(RECENT) || { echo "$$OLD_VENV" >&2; exit 1; }
	@$(PY) -m pip --version >/dev/null 2>&1 || $(PY) -m ensurepip
	@echo "installing into $(VENV); this takes a minute or two the first time"
	$(INSTALL) hatchling
	$(INSTALL) --no-build-isolation --editable .
	@touch $@

$(TOOLS): $(RUNTIME)
	$(INSTALL) --no-build-isolation --editable '.[dev]'
	@touch $@
