# Each target makes .venv from the lock file if it is missing or older than it.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin

.PHONY: reproduce test lint format bench docs findings lock clean

reproduce: $(VENV)/.test
	$(BIN)/snakemake

test: $(VENV)/.test
	$(BIN)/pytest

lint: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

format: $(VENV)/.lint
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/features.py
	$(BIN)/python benchmarks/loading.py
	$(BIN)/python benchmarks/solver.py
	$(BIN)/python benchmarks/solver.py --scheme second

# The site, results/docs/index.html; it needs no network, to build or to read.
docs: $(VENV)/.docs
	$(BIN)/python tools/configuration.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

# Figures of the last run into README and docs, between their markers.
findings: $(VENV)/.test
	$(BIN)/python -m tools.findings

# Resolve new versions (maintainers only; needs uv), then write them into environment.yml.
lock: $(VENV)/.test
	tools/lock.sh
	$(BIN)/python tools/environment.py

clean:
	rm -rf results .ajgdata .snakemake

$(VENV)/.%: requirements.lock pyproject.toml tools/bootstrap.sh
	@echo "Setting up $(VENV) for '$*' (a few minutes the first time) ..."
	@tools/bootstrap.sh $(PYTHON) $(VENV) $*
	@touch $@
