# Each target makes .venv from the lock file if it is missing or older than it.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin

.PHONY: env reproduce everything real test test-slow test-cpus test-browser test-cluster test-jack test-lowest test-torture test-workflow lint format bench docs readme sample lock address clean

# ARGS are passed on: make reproduce ARGS=--dry-run, make test ARGS=tests/docs.
reproduce: $(VENV)/.test
	$(BIN)/snakemake $(ARGS)

# Only the environment.
env: $(VENV)/.test

# Also what is beyond the paper: variants, final models, published data sets.
everything: $(VENV)/.test
	$(BIN)/snakemake everything $(ARGS)

# Public recordings by other labs, from the web, and a report on them alone; NAMES="esc10 ..." chooses.
NAMES ?= $(shell grep -l '^status: run' datasets/*/source.yaml | xargs -n 1 dirname | xargs -n 1 basename)
real: $(VENV)/.test
	for name in $(NAMES); do $(BIN)/ajgdata fetch $$name || [ $$? = 3 ] || exit 1; done
	$(BIN)/ajgdata run $(NAMES)

test: $(VENV)/.test
	$(BIN)/pytest $(ARGS)

# What takes minutes: long runs of the solver, many kills, an installed package.
test-slow: $(VENV)/.test
	$(BIN)/pytest -m slow

# All rules of the workflow on two simulated cubes, then Snakemake's own report: a minute.
test-workflow: $(VENV)/.test
	$(BIN)/snakemake everything --directory .test --snakefile workflow/Snakefile \
	  --configfile .test/config/config.yaml --workflow-profile profiles/default
	$(BIN)/snakemake --report results/report.zip --directory .test --snakefile workflow/Snakefile \
	  --configfile .test/config/config.yaml

# The tests with other CPU kernels and thread counts; after `make reproduce`, also the checks of its results.
VARIANTS ?= ATEN_CPU_CAPABILITY=default OPENBLAS_CORETYPE=Haswell OPENBLAS_CORETYPE=Prescott \
  NPY_DISABLE_CPU_FEATURES=X86_V3,X86_V4,AVX512_ICL,AVX512_SPR OMP_NUM_THREADS=1 OMP_NUM_THREADS=4
test-cpus: $(VENV)/.test
	for variant in $(VARIANTS); do \
	  echo "== $$variant"; env $$variant $(BIN)/pytest $(ARGS) || exit 1; \
	  [ ! -d results/report ] || env $$variant $(BIN)/pytest -m artefact tests/artefacts || exit 1; \
	done

# Pages in a real browser: two small reports (results/report instead of the second if it exists), the dashboard, the page of browse; AJGDATA_SCREENSHOTS=1 writes the dashboard's pictures. Needs Debian's chromium and chromium-driver.
test-browser: $(VENV)/.test $(VENV)/.browser
	AJGDATA_REQUIRE_BROWSER=1 $(BIN)/pytest -n 0 -m browser tests/browser

# A small project on a SLURM that the tests start on this machine (docs/cluster.md); as root. Debian: slurmctld slurmd slurm-client munge.
test-cluster: $(VENV)/.test $(VENV)/.cluster
	AJGDATA_REQUIRE_CLUSTER=1 $(BIN)/pytest -n 0 -m cluster tests/cluster

# Sessions through a simulated sound card. Debian: jackd2 libportaudio2.
test-jack: $(VENV)/.test $(VENV)/.jack
	AJGDATA_REQUIRE_JACK=1 $(BIN)/pytest -n 0 -m jack tests/jack

# The tests with the lowest versions that pyproject.toml allows (maintainers only; Python 3.11, needs uv).
OF_LOCKED_VERSIONS = tests/contract/test_environment.py::test_installed_versions_are_the_locked_ones \
  tests/docs/test_configuration.py::test_the_command_line_reference_is_current
test-lowest:
	@mkdir -p build
	uv pip compile pyproject.toml workflow/logger/pyproject.toml --python $(PYTHON) --quiet \
	  --resolution lowest-direct --extra all --group setup --group test --output-file build/lowest.txt
	tools/bootstrap.sh $(PYTHON) build/lowest test build/lowest.txt
	build/lowest/bin/pytest $(addprefix --deselect ,$(OF_LOCKED_VERSIONS)) $(ARGS)

# Kills, full disks, races (docs/reliability.md).
# AJGDATA_TORTURE_SHARE=0.1 makes a tenth of the trials, AJGDATA_TORTURE_SECONDS bounds each kind, AJGDATA_TORTURE_SEED gives others.
test-torture: $(VENV)/.test
	$(BIN)/pytest -n 0 -s -m torture tests/torture

lint: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python -m tools.lint_workflow

format: $(VENV)/.lint
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

bench: $(VENV)/.bench
	$(BIN)/python benchmarks/features.py
	$(BIN)/python benchmarks/solver.py

# The site, results/docs/index.html; it needs no network, to build or to read.
docs: $(VENV)/.docs
	$(BIN)/python tools/configuration.py
	$(BIN)/python -m tools.examples
	$(BIN)/python -m tools.feature_page
	$(BIN)/typer ajgdata.cli utils docs --name ajgdata --title "Command line" --output docs/command-line.md
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

# The README's table from the last run; pictures of its report and of docs/start.md (make real NAMES=active_rp) into docs/images.
readme: $(VENV)/.test $(VENV)/.browser
	$(BIN)/python -m tools.readme_table
	$(BIN)/python -m tools.screenshots
	$(BIN)/python -m tools.start_pictures

# The simulated sample of the package, from the features of the last run (maintainers only).
sample: $(VENV)/.test
	$(BIN)/snakemake results/samples/ycb.nc
	cp results/samples/ycb.nc ajgdata/samples/

# Resolve new versions (maintainers only; needs uv), then write them into environment.yml.
lock: $(VENV)/.test
	tools/lock.sh
	$(BIN)/python tools/environment.py

# The addresses of [project.urls] in pyproject.toml, written into all files (maintainers only).
address: $(VENV)/.test
	$(BIN)/python -m tools.address

clean:
	rm -rf results .ajgdata .snakemake

$(VENV)/.%: requirements.lock pyproject.toml workflow/logger/pyproject.toml tools/bootstrap.sh
	@echo "Setting up $(VENV) for '$*' (a few minutes the first time) ..."
	@tools/bootstrap.sh $(PYTHON) $(VENV) $*
	@touch $@
