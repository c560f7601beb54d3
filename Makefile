# Everything is a verb here; `make help` lists them. Set-up is automatic and happens once, in .venv.
SHELL := /bin/bash
.DEFAULT_GOAL := help

PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do command -v $$p >/dev/null && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
UV := $(BIN)/uv
# pip comes with Python; uv, which is faster, is there where more than the main job was asked for.
# One at a time, as targets are made side by side.
INSTALL = $$(test -x $(UV) && echo $(UV) pip install -q --python $(BIN)/python || echo $(BIN)/python -m pip install -q --disable-pip-version-check)
# A file of tests stays in one process, with what its tests share; tests/conftest.py puts the long files first. One process
# more than there are cores: tests wait for servers, browsers and deadlines a third of their time.
WORKERS = $(shell $(BIN)/python -c 'import os; print(1 + (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1))')
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadscope --no-loadscope-reorder
NATIVE := CMakeLists.txt pyproject.toml $(wildcard native/include/racecraft/*.hpp native/src/* native/gpu/*)

PAGES := src/racecraft/serve/pages/index.html
NODE := web/node_modules/.package-lock.json
IDENTITY := tests/serve/identity_provider/node_modules/.package-lock.json
# What Vite runs on; Debian 12 and Ubuntu 24.04 bring an older one.
NODE_OF_TODAY = node --version | awk -F'[v.]' '{ exit !($$2 == 20 && $$3 >= 19 || $$2 == 22 && $$3 >= 12 || $$2 > 22) }' \
	|| { echo "Pages are built with Node 20.19, 22.12 or newer, and node on PATH is $$(node --version): nodejs.org has newer ones."; exit 1; }
WEB := $(wildcard web/*.json web/*.ts web/*.js web/index.html web/src/* web/src/*/* web/src/*/*/*)

# CMake and Ninja: the system's where it has both, otherwise PyPI's, in a folder of their own that only compiling needs.
TOOLS := $(shell cmake --version 2>/dev/null | awk '/^cmake version/ { split($$3, v, "."); if (v[1] > 3 || v[2] >= 20) found = 1 } END { exit !found }' \
	&& command -v ninja >/dev/null || echo build/tools/bin/ninja)
BUILD_PATH = $$PATH:$(CURDIR)/$(BIN):$(CURDIR)/build/tools/cmake/data/bin:$(CURDIR)/build/tools/bin

# The compiler of WebAssembly, in a folder of its own: nothing else needs it.
ZIG := build/zig/ziglang/zig
# What makes pages of docs/*.md, likewise.
SPHINX := build/sphinx/furo/__init__.py

# Without bytecode kept, every process of a test compiles what it imports anew: most of the time of a server's start.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: FORCE help train console site wheel test test-fast mutants lint format bench setup build stub clean requirements

help:  ## show this list
	@grep -hE '^[a-z-]+:.*##' Makefile | sed -E 's/:.*## /\t/' | awk -F'\t' '{printf "  make %-13s %s\n", $$1, $$2}'

train: $(VENV)/.built  ## set up if needed, then train a car from camera pixels until it drives 5 of 5 laps
	$(BIN)/racecraft train --until "5 laps" --video

console: $(VENV)/.built $(VENV)/.serve $(PAGES)  ## set up if needed, build the console's pages, and open it in a browser
	$(BIN)/racecraft serve

WASM = $(MAKE) --no-print-directory -j$$($(BIN)/python -c 'import os; print(os.cpu_count() or 1)') -f native/wasm/Makefile ZIG=$(CURDIR)/$(ZIG)
CORES = $(patsubst %,build/wasm/%.wasm,core exact scalar threads)
site: $(ZIG) $(SPHINX) $(VENV)/.built $(VENV)/.serve $(NODE)  ## build build/site: a page where cars learn in a browser's tab, for any static host
	@$(WASM)
	@cd web && npm run --silent site
	@mkdir -p build/site/core && cp $(CORES) build/site/core
	@PYTHONPATH=build/sphinx $(BIN)/python -m sphinx -q -W --keep-going -c tools/docs -d build/doctrees docs build/site/docs
	@$(BIN)/python -m racecraft.site build/site web/node_modules/pyodide

build/wasm/%.wasm: $(ZIG) FORCE
	@$(WASM) $@

FORCE:

wheel: $(UV) $(VENV)/.train $(TOOLS) $(PAGES)  ## build dist/: an sdist, and a wheel for this Python and machine with the console's pages inside
	@mkdir -p build
	@PATH="$(BUILD_PATH)" $(UV) build --sdist --wheel --python $(BIN)/python --no-build-isolation --out-dir dist >build/wheel.log 2>&1 \
		|| { tail -n 60 build/wheel.log; exit 1; }
	@grep "^Successfully built" build/wheel.log

test: $(VENV)/.built $(VENV)/.dev $(PAGES) $(IDENTITY)  ## set up if needed, then run every test, on every core
	$(PYTEST) --durations=40

test-fast: $(VENV)/.built $(VENV)/.dev  ## the tests that take seconds
	$(PYTEST) -m "not slow and not costly"

mutants: $(VENV)/.built $(VENV)/.dev  ## plant small faults, one at a time, and count which ones the tests notice (hours; goes on where it stopped)
	$(BIN)/python tests/mutants/plant_python.py --jobs 2
	$(BIN)/python tests/mutants/plant_native.py --sample 100

lint: $(VENV)/.built $(VENV)/.dev $(NODE)  ## ruff, mypy --strict, clang-format, prettier and eslint, changing nothing
	$(BIN)/ruff check --no-cache .  # whose key knows nothing of files that moved
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror native/include/racecraft/*.hpp native/src/*.hpp native/src/*.cpp native/gpu/* native/wasm/*.[ch]pp native/tests/*.cpp
	cd web && npm run --silent lint

format: $(VENV)/.dev $(NODE)  ## apply ruff, clang-format and prettier
	$(BIN)/ruff check --fix-only -q .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i native/include/racecraft/*.hpp native/src/*.hpp native/src/*.cpp native/gpu/* native/wasm/*.[ch]pp native/tests/*.cpp
	cd web && npm run --silent format

bench: $(VENV)/.built $(VENV)/.dev  ## measure all but the long trainings, rivals included, and print the table
	$(BIN)/racecraft bench

setup: $(VENV)/.built  ## only the set-up: .venv with the command .venv/bin/racecraft

build: $(VENV)/.built  ## compile the native core again if its sources changed

stub: $(VENV)/.built  ## copy the generated type stub of the native core into the source tree
	cp $$($(BIN)/python -c "import sysconfig; print(sysconfig.get_paths()['purelib'])")/racecraft/_native.pyi src/racecraft/_native.pyi

clean:  ## remove the environment and everything built
	rm -rf $(VENV) build

requirements: $(UV)  ## pin the newest allowed versions again
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header pyproject.toml requirements/build.in -o requirements/train.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header -c requirements/train.txt requirements/dev.in -o requirements/dev.txt
	$(UV) pip compile -q --universal --python-version 3.11 --generate-hashes --no-header --extra serve --extra tune --extra multi -c requirements/dev.txt pyproject.toml -o requirements/serve.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header requirements/tools.in -o requirements/tools.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header requirements/uv.in -o requirements/uv.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header requirements/site.in -o requirements/site.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header requirements/docs.in -o requirements/docs.txt
	$(UV) pip compile -q --no-deps --universal --python-version 3.11 --generate-hashes --no-header requirements/transfer.in -o requirements/transfer.txt
	$(UV) pip compile -q -U --universal --python-version 3.11 --generate-hashes --no-header -c requirements/train.txt requirements/ray.in -o requirements/ray.txt
	$(UV) pip compile -q -U --no-deps --universal --python-version 3.11 --generate-hashes --no-header requirements/rllib.in -o requirements/rllib.txt

$(VENV)/pyvenv.cfg:
	@test -n "$(PYTHON)" || { echo "Racecraft needs Python 3.11 or newer; none was found on PATH."; exit 1; }
	@$(PYTHON) tools/prerequisites.py
	@echo "Set-up, once, in $(VENV): about a minute on two cores, three on slow ones."
	@echo "1 of 3: an environment of its own for $$($(PYTHON) --version) ..."
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip uninstall -q -y setuptools 2>/dev/null || true  # which 3.11 brings and nothing here needs

$(UV): requirements/uv.txt | $(VENV)/pyvenv.cfg
	@flock $(VENV)/.build-lock $(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements/uv.txt
	@touch $(UV)

# Without bytecode of what is not imported; the first run makes the rest.
$(VENV)/.train: requirements/train.txt | $(VENV)/pyvenv.cfg
	@echo "2 of 3: packages from PyPI, some 30 MB ..."
	@flock $(VENV)/.build-lock $(SHELL) -c '$(INSTALL) $$(test -x $(UV) || echo --no-compile) --require-hashes -r requirements/train.txt'
	@touch $@

build/tools/bin/ninja: requirements/tools.txt | $(VENV)/pyvenv.cfg
	@echo "CMake and Ninja from PyPI, some 30 MB, as this system has none that will do ..."
	@$(BIN)/python -m pip install -q --disable-pip-version-check --upgrade --target build/tools --require-hashes -r requirements/tools.txt
	@touch $@

$(VENV)/.dev: $(UV) $(VENV)/.train requirements/dev.txt
	@echo "Packages that only tests need, PyTorch among them: some 3 GB, a minute or two the first time ..."
	@$(UV) pip install -q --python $(BIN)/python --require-hashes -r requirements/dev.txt
	@touch $@

$(VENV)/.serve: $(UV) $(VENV)/.train requirements/serve.txt
	@echo "Packages of the console's server ..."
	@$(UV) pip install -q --compile-bytecode --python $(BIN)/python --require-hashes -r requirements/serve.txt
	@touch $@

$(ZIG): $(UV) requirements/site.txt
	@echo "A compiler of WebAssembly from PyPI, some 90 MB ..."
	@$(UV) pip install -q --python $(BIN)/python --target build/zig --require-hashes -r requirements/site.txt
	@touch $@

$(SPHINX): $(UV) requirements/docs.txt
	@echo "A generator of the documentation's pages from PyPI, some 20 MB ..."
	@$(UV) pip install -q --python $(BIN)/python --target build/sphinx --require-hashes -r requirements/docs.txt
	@touch $@

build/ray: $(UV) requirements/ray.txt  # for tests/tuning/test_cluster.py and examples/rllib_ppo.py
	@echo "Ray from PyPI, some 80 MB ..."
	@$(UV) pip install -q --python $(BIN)/python --target build/ray --require-hashes -r requirements/ray.txt
	@touch $@

build/rllib: build/ray $(VENV)/.dev requirements/rllib.txt  # for examples/rllib_ppo.py alone, beside what tests need
	@echo "What RLlib needs from PyPI, some 60 MB ..."
	@$(UV) pip install -q --python $(BIN)/python --target build/rllib --no-deps --require-hashes -r requirements/rllib.txt
	@touch $@

build/mujoco: $(UV) requirements/transfer.txt  # for benchmarks/transfer.py alone
	@echo "MuJoCo from PyPI, some 30 MB ..."
	@$(UV) pip install -q --python $(BIN)/python --target build/mujoco --no-deps --require-hashes -r requirements/transfer.txt
	@touch $@

$(NODE): web/package.json web/package-lock.json
	@command -v npm >/dev/null || { echo "The console's pages are built with Node and npm; neither was found on PATH."; exit 1; }
	@$(NODE_OF_TODAY)
	@echo "Packages of the pages, from npm: half a minute ..."
	@cd web && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

$(IDENTITY): tests/serve/identity_provider/package.json tests/serve/identity_provider/package-lock.json
	@command -v npm >/dev/null || { echo "Sign-in is tested against a provider that runs on Node; npm was not found on PATH."; exit 1; }
	@$(NODE_OF_TODAY)
	@echo "A provider to sign in through, for tests, from npm ..."
	@cd tests/serve/identity_provider && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

$(PAGES): $(WEB) $(NODE)
	@echo "Building the pages ..."
	@cd web && npm run --silent build
	@touch $@

$(VENV)/.built: $(VENV)/.train $(TOOLS) $(NATIVE)
	@echo "3 of 3: compiling the simulator and the learner: the longest part ..."
	@PATH="$(BUILD_PATH)" flock $(VENV)/.build-lock $(SHELL) -c '$(INSTALL) --no-build-isolation --no-deps -e .'
	@$(BIN)/python -m compileall -q src/racecraft
	@touch $@
