# `make demo` and `make test` set up .venv themselves and reuse it afterwards.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test test-long test-slow mutants gate lint docs gallery compiled clean

demo: compiled
	$(BIN)/harness demo

# The fast tests; `make test-long` runs the others but for the slow ones.
test: compiled
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow and not long"

test-long: compiled
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "long and not slow" --durations 15

test-slow: compiled
	$(BIN)/python -m pytest -m slow --hypothesis-profile=default

# Changes 60 lines of the package, one at a time, and counts the tests that notice: see CONTRIBUTING.md.
mutants: compiled
	$(BIN)/python -m tests.mutants --jobs 2

# Compares the project's own methods with their baseline: see CONTRIBUTING.md.
gate: compiled
	rm -rf build/gate
	$(BIN)/harness run gate --jobs 2 --no-report --out build/gate
	$(BIN)/harness compare gate build/gate --html build/gate/comparison.html

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The site of docs/ with the API reference, in build/site. A broken link is an error.
docs: $(VENV)/.dev
	$(BIN)/mkdocs build --strict

# The studies of docs/gallery.md, in build/gallery, and their pictures and results in docs.
gallery: compiled $(VENV)/.dev
	$(BIN)/python -m tests.gallery

# Exact versions come from requirements.lock, the ranges from pyproject.toml.
$(VENV)/.ready: pyproject.toml requirements.lock
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or later is needed: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --disable-pip-version-check --constraint requirements.lock --editable '.[viz,test]'
	touch $@

compiled: $(VENV)/.compiled

$(VENV)/.compiled: $(VENV)/.ready
	@echo 'compiling the inner loops once, for about a minute (docs/installation.md)'
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m harness.testing.compile_all
	touch $@

$(VENV)/.dev: $(VENV)/.ready
	$(BIN)/python -m pip install --disable-pip-version-check --constraint requirements.lock --editable '.[viz,test,dev]'
	touch $@

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis
