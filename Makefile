# make demo: set everything up and run the whole chain in simulation.  make test: the same for the tests.
VENV ?= .venv
BIN := $(VENV)/bin
# ur-rtde ships wheels for Python 3.11 and 3.12
PYTHON ?= $(shell for p in python3.12 python3.11 python3; do \
	$$p -c 'import sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 13))' 2>/dev/null && echo $$p && break; done)

.PHONY: demo test check clean
demo: $(VENV)/demo.stamp
	$(BIN)/coneskin demo

test: $(VENV)/test.stamp
	$(BIN)/python -m pytest

check: $(VENV)/test.stamp $(VENV)/dev.stamp
	PATH="$(CURDIR)/$(BIN):$$PATH" scripts/check

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "coneskin needs Python 3.11 or 3.12 with venv: name one with make PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/demo.stamp: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install -q -e '.[pictures,design]'
	touch $@

$(VENV)/test.stamp: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install -q -e '.[pictures,design,test]'
	touch $@

$(VENV)/dev.stamp: $(VENV)/test.stamp
	$(BIN)/python -m pip install -q -e '.[pictures,design,test,dev]'
	touch $@

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache
