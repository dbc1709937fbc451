# Builds the environment and starts things; what the things do is in Python.
# Every path is relative, so that the checkout may lie in a folder with a blank.

# Otherwise uv refuses a network that signs its traffic with a local certificate.
export UV_SYSTEM_CERTS = true
export PIP_DISABLE_PIP_VERSION_CHECK = 1
# Some machines forbid compiled modules to be kept: the tests start a hundred programs,
# and each would compile the same libraries for two to four seconds.
export PYTHONDONTWRITEBYTECODE =

# Name another interpreter with `make PYTHON=... demo`.
PYTHON ?=
CANDIDATES = $(if $(PYTHON),"$(PYTHON)",python3 python3.11 python3.12 python3.13 python3.14)
RUN := .venv/bin/python -m
READY := .venv/.ready

.DEFAULT_GOAL := help
.PHONY: help demo test test-all check bench bench-guard fuzz desktop dist dist-check \
    clean

help:  ## list these targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' Makefile \
	    | while IFS='|' read -r name text; do printf '%-16s %s\n' "$$name" "$$text"; done

demo: $(READY)  ## fly the recorded path without a screen; results in out/demo
	$(RUN) app demo --out out/demo

# A worker that crashed is not begun anew: xdist 3.8 may wait for ever at the end then.
test: $(READY)  ## run the tests, slow ones left out
	$(RUN) pytest -m "not slow" -n 2 --dist loadfile --no-loadscope-reorder \
	    --max-worker-restart 0

test-all: $(READY)  ## run every test
	$(RUN) pytest -n 2 --dist loadfile --max-worker-restart 0

check: $(READY)  ## lint, format check, strict types, import floors
	$(RUN) ruff check
	$(RUN) ruff format --check
	$(RUN) mypy
	.venv/bin/lint-imports --no-logo

bench: $(READY)  ## measure run time against error
	$(RUN) app bench

bench-guard: $(READY)  ## fail where a row got slower or less right since the release
	$(RUN) app bench guard

fuzz: $(READY)  ## look for files that readers cannot take, ten minutes for each reader
	.venv/bin/uv pip install atheris
	$(RUN) tests.stress.fuzz

desktop: $(READY)  ## open the trainee's window and steer with mouse and keys
	$(RUN) app train

dist: $(READY)  ## make the source distribution and the wheel, in dist
	rm -rf dist
	$(RUN) hatchling build -d dist

# In a folder of its own: neither the checkout nor its environment may be of help.
dist-check: dist  ## install the wheel into an empty environment, fly the demo from there
	rm -rf out/installed
	mkdir -p out/installed
	.venv/bin/uv venv $(if $(PYTHON),--python "$(PYTHON)") out/installed/env
	.venv/bin/uv pip install --python out/installed/env/bin/python dist/*.whl
	cd out/installed && PYTHONSAFEPATH=1 env/bin/paravol demo --out demo

clean:  ## remove the environment, tool caches and out/demo
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis \
	    .import_linter_cache build dist out/demo

# The stamp goes first and comes back last: an interrupted set-up is never taken
# for a finished one, and the next one starts from an empty environment.
$(READY): pyproject.toml requirements.lock
	@set -eu; \
	fail() { echo "$$1" >&2; exit 1; }; \
	python=; set -- $(CANDIDATES); \
	for name do \
	    if "$$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	        2> /dev/null; then python=$$name; break; fi; \
	done; \
	[ -n "$$python" ] || fail "No Python 3.11 or newer among '$$*': install\
	 one (Debian 12: python3) or name it with make PYTHON=/path/to/python3."; \
	clear=--clear; if [ -e $@ ]; then rm $@; clear=; fi; \
	echo "Setting up .venv with $$python (about 2 GB on disk, once) ..."; \
	"$$python" -m venv $$clear --without-pip .venv || \
	    fail "$$python cannot make virtual environments; on Debian install\
	 python3-venv."; \
	if "$$python" -m pip --python .venv/bin/python --version > /dev/null 2>&1; then \
	    pip() { "$$python" -m pip --python .venv/bin/python "$$@"; }; \
	elif .venv/bin/python -m ensurepip > /dev/null 2>&1; then \
	    pip() { .venv/bin/python -m pip "$$@"; }; \
	else \
	    fail "$$python has no pip, which fetches the libraries; on Debian install\
	 python3-pip, then run make again."; \
	fi; \
	if pip install uv && .venv/bin/uv pip install --python .venv/bin/python \
	    -r requirements.lock && .venv/bin/uv pip install \
	    --python .venv/bin/python --no-deps -e .; then :; else \
	    echo "uv did not finish; trying plain pip, which is slower."; \
	    pip install -r requirements.lock; \
	    pip install --no-deps -e .; \
	fi; \
	touch $@
