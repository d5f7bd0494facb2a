# make demo: set up, draw the chart, run the main job, draw the run.  make test, slow, check: what CI runs.
PYTHON ?= $(or $(shell for p in python3 python3.13 python3.12 python3.11; do \
  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done),python3)
BIN := .venv/bin
ALONE := $(BIN)/python -m pytest -q
BESIDE := $(ALONE) -n auto --dist loadfile
STOLEN := $(ALONE) -n auto --dist worksteal
SLEEPERS := $(ALONE) -n 4 --dist loadfile
LONG := $(if $(CI),slow,slow or hypothesis)
THOROUGH := $(if $(CI),,THOROUGH=1)
SWEEPS = $(notdir $(basename $(wildcard cobodeck/campaign/files/precision_*.yaml cobodeck/campaign/files/disturbed_*.yaml cobodeck/campaign/files/key_*.yaml)))
# the second also if the first fails; 5: nothing of it was asked for
both = failed=0; $(1) $(PYTEST) || [ $$? = 5 ] || failed=1; $(2) $(PYTEST) || [ $$? = 5 ] || failed=1; exit $$failed
# tests start many processes: their modules are compiled once, whatever the shell says
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test slow check format schema docs bench sweeps figures clean

demo: .venv/installed
	@$(BIN)/cobodeck render cobodeck -o out/cobodeck.svg
	@rm -f out/demo.mcap out/demo.mcap.part
	@$(BIN)/cobodeck simulate cobodeck --scene lab_a --user demo --requests 5 --record out/demo.mcap
	@$(BIN)/cobodeck render out/demo.mcap -o out/demo.svg
	@echo; echo "cobodeck is in $(BIN); to call it by its name: . $(BIN)/activate"
	@echo "to see the run in a browser: cobodeck watch out/demo.mcap; one that goes on: cobodeck simulate --live"

# the tests of a file share what they compile and record, so that it stays with one worker;
# what runs in real time has the machine to itself, files beside each other; it sleeps most of its time;
# what fails there for once is repeated, and told as RERUN.
test: .venv/installed-dev
	@$(call both,$(BESIDE) -m "not slow and not realtime",$(SLEEPERS) -m "not slow and realtime")

# properties with all their examples, too; in CI these are what `test` has
slow: .venv/installed-dev
	@$(call both,$(THOROUGH) $(STOLEN) -m "($(LONG)) and not realtime",$(THOROUGH) $(ALONE) -m "($(LONG)) and realtime")

check: .venv/installed-dev
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check --quiet .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo
	@$(BIN)/cobodeck validate --strict

format: .venv/installed-dev
	@$(BIN)/ruff check --fix --quiet .
	@$(BIN)/ruff format .

schema: .venv/installed
	@$(BIN)/cobodeck schema -o charts/chart.schema.json

# the reference pages; a test compares them
docs: .venv/installed
	@$(BIN)/cobodeck docs --no-project -o cobodeck/docs/reference

# each takes some minutes, best on a machine that has nothing else to do
BENCHES := engine navigation drives chase arm localization simulation reference realtime live stability envelope
bench: .venv/installed-dev
	@mkdir -p out
	@for name in $(BENCHES); do \
	  $(BIN)/cobodeck bench $$name --pretty > out/$$name.json && mv out/$$name.json cobodeck/bench/results/ || exit 1; done
	@$(BIN)/cobodeck bench --show cobodeck/bench/results/*.json -o cobodeck/bench/curves.svg > out/bench.txt
	@$(BIN)/cobodeck bench envelope --rounds 1 -o cobodeck/avoidable/envelope.svg > out/envelope.txt
	@$(MAKE) figures

# what precision is worth, and which disturbances are borne: hours of CPU; goes on where it was
sweeps: .venv/installed-dev
	@mkdir -p out/sweeps
	@set -e; for name in $(SWEEPS); do \
	  $(BIN)/cobodeck campaign $$name --out out/sweeps/$$name --worst 0 --json > out/sweeps/$$name.json; done
	@$(BIN)/python -m cobodeck.bench.system out/sweeps
	@$(MAKE) figures

# every block of figures in a page, from the committed results
figures: .venv/installed
	@$(BIN)/python -m cobodeck.pages

clean:
	rm -rf .venv out build *.egg-info

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "$(PYTHON) is too old: 3.11 or newer is needed; try make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv .venv >/dev/null 2>&1 || \
	  { rm -rf .venv; $(PYTHON) -m venv --without-pip .venv && $(PYTHON) -m pip --version >/dev/null; } || \
	  { rm -rf .venv; echo "cannot make .venv: install pip or venv for $(PYTHON), on Debian: apt install python3-venv"; exit 1; }

# the pip of the environment where it has one, else the system's for it
INSTALL = @echo "installing into .venv, some minutes the first time"; \
  if test -x $(BIN)/pip; then pip="$(BIN)/python -m pip"; else pip="$(PYTHON) -m pip --python $(BIN)/python"; fi; \
  $$pip install -qq --disable-pip-version-check

.venv/installed: .venv/bin/python pyproject.toml
	$(INSTALL) -e ".[record,plots]"
	@touch $@

.venv/installed-dev: .venv/bin/python pyproject.toml
	$(INSTALL) -e ".[dev,peers,all,reference,cluster]"
	@touch $@ .venv/installed
