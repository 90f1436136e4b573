# make demo    set everything up and run the whole chain in simulation
# make test    the short run of the tests
# make check   what CI runs: format, lint, types, all tests, the properties with examples by SEED, or by the commit
# make docs    the site, in build/site
# make fuzz    the property tests with new random examples; SEED=123 repeats a run, MINUTES=5 goes on with new seeds
# make dist    wheel and source distribution, in dist/; where there is a C compiler, a compiled wheel too
# make compiled  compile the live path in place, by mypyc; make pure takes that back; neither is needed for anything
# make check-compiled  the short tests, and all bit-exact replays, on a compiled copy in build/compiled
VENV ?= .venv
BIN := $(VENV)/bin
# 3.12 and 3.11 first, for which ur-rtde ships wheels
PYTHON ?= $(shell for p in python3.12 python3.11 python3 python3.13 python3.14; do \
	$$p -c 'import sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)

# hundreds of Python processes start in the tests: without bytecode on the disk each of them compiles all modules anew
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test check docs fuzz dist compiled pure check-compiled clean
demo: $(VENV)/demo.stamp
	$(BIN)/coneskin demo

test: $(VENV)/test.stamp
	PATH="$(CURDIR)/$(BIN):$$PATH" scripts/tests "not long"

check: $(VENV)/dev.stamp
	PATH="$(CURDIR)/$(BIN):$$PATH" scripts/check

docs: $(VENV)/docs.stamp
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

fuzz: $(VENV)/test.stamp
	PATH="$(CURDIR)/$(BIN):$$PATH" scripts/fuzz

dist: $(VENV)/dev.stamp
	rm -rf dist
	$(BIN)/python -m build
	! command -v cc >/dev/null || CONESKIN_COMPILE=1 $(BIN)/python -m build --wheel

compiled: $(VENV)/dev.stamp
	@echo "compiling takes some minutes of two cores"
	CONESKIN_COMPILE=1 $(BIN)/python setup.py -q build_ext --inplace
	$(BIN)/coneskin --version

pure:
	find -L src \( -name '*.so' -o -name '*.pyd' \) -delete

# what users install, by a quick C compiler: the wheel of the source distribution, and beside it what is in it
build/compiled/done: setup.py $(shell find -L src/coneskin -name '*.py') | $(VENV)/dev.stamp
	rm -rf build/compiled
	$(BIN)/python -m build -q --sdist --no-isolation --outdir build/compiled
	CONESKIN_COMPILE=1 $(BIN)/python -m pip wheel -q --no-deps --no-build-isolation -w build/compiled build/compiled/*.tar.gz
	$(BIN)/python -m zipfile -e build/compiled/*.whl build/compiled
	find build/compiled -name '*.so' -exec touch {} + && touch $@  # later than their sources

check-compiled: $(VENV)/dev.stamp build/compiled/done
	PATH="$(CURDIR)/$(BIN):$$PATH" PYTHONPATH="$(CURDIR)/build/compiled" scripts/tests "not long"

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "coneskin needs Python 3.11 or newer with venv: name one with make PYTHON=..."; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/demo.stamp: extras = pictures
$(VENV)/test.stamp: extras = design,test
$(VENV)/dev.stamp: extras = design,check,dev,docs
$(VENV)/dev.stamp: more = $(VENV)/test.stamp
$(VENV)/docs.stamp: extras = docs
# uv takes a third of pip's time; where it cannot be had, or its index not be reached, pip does it
$(VENV)/%.stamp: $(VENV)/bin/python pyproject.toml setup.py
	@echo "installing coneskin[$(extras)]"
	@index="$${UV_DEFAULT_INDEX:-$${PIP_INDEX_URL:-$$($(BIN)/python -m pip config get global.index-url 2>/dev/null)}}"; \
		[ -z "$$index" ] || export UV_DEFAULT_INDEX="$$index"; \
		$(BIN)/python -m pip install -q uv && $(BIN)/python -m uv pip install -q --compile-bytecode -p $(BIN)/python -e '.[$(extras)]' || \
		$(BIN)/python -m pip install -q -e '.[$(extras)]'
	@touch $@ $(more)

clean:
	rm -rf $(VENV) build dist *.egg-info src/*.egg-info .pytest_cache .mypy_cache .ruff_cache
