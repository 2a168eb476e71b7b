# make dagger       installs into .venv, then runs the main job      make dagger ARGS="--preset smoke"
# make test         installs into .venv; lint, types and tests       make test PYTEST_ARGS="tests/env -x"
# make test-newest  the same tests on the newest gymnasium and stable-baselines3, in .venv-newest
# make docs         builds the documentation into docs/_build         open docs/_build/index.html
# make web          builds the page for the browser into web/build/site; needs Node 20 and npm
# make web-test     tests it against Python's robot, and in Chromium where there is one
# make web-serve    serves that page                                   open http://localhost:8080/
# make clean        removes both environments and everything built
#
# Another interpreter: make test PYTHON=python3.12 (after make clean).
# On Linux the default package index serves PyTorch with CUDA, several GB. Without a GPU, point pip at PyTorch's CPU
# index yourself (environment variable PIP_EXTRA_INDEX_URL, or pip.conf); torch==2.13.0+cpu satisfies the constraints.

PYTHON ?= python3
ARGS ?=
PYTEST_ARGS ?= -n 2 --dist worksteal

PIP = bin/python -m pip --disable-pip-version-check install
TESTED = -c constraints/tested.txt
SOURCES = pyproject.toml constraints/tested.txt

# The tests' processes run side by side, one thread each.
test test-newest: export OMP_NUM_THREADS = 1
test test-newest: export OPENBLAS_NUM_THREADS = 1
test test-newest: export MKL_NUM_THREADS = 1

.PHONY: dagger test test-newest docs web web-test web-serve needs-node clean

dagger: .venv/.installed
	.venv/bin/python examples/dagger.py $(ARGS)

test: .venv/.installed-test
	.venv/bin/ruff check .
	.venv/bin/mypy
	.venv/bin/python -m pytest $(PYTEST_ARGS)

test-newest: .venv-newest/.installed-test
	.venv-newest/bin/python -m pytest $(PYTEST_ARGS)

docs: .venv/.installed-docs
	.venv/bin/python -m sphinx -E -W --keep-going -q -b html docs docs/_build

# Python writes what the page needs and what it is tested with; everything in web/build is made anew by these.
web: needs-node .venv/.installed web/node_modules/.package-lock.json
	.venv/bin/python -m web.export $(ARGS)
	cd web && npm run --silent build

web-test: web
	.venv/bin/python -m web.reference $(ARGS)
	cd web && npm run --silent test && npm run --silent smoke

web-serve: needs-node
	cd web && npm run --silent serve

# Said before anything large is installed.
needs-node:
	@command -v node >/dev/null && command -v npm >/dev/null || \
		{ echo "The page needs Node 20 or newer, with npm (https://nodejs.org); there is none on the PATH." >&2; exit 1; }
	@node -e 'const { node } = process.versions; if (parseInt(node) < 20) { console.error("The page needs Node 20 or newer, this is " + node + ": https://nodejs.org"); process.exit(1); }'

web/node_modules/.package-lock.json: web/package.json web/package-lock.json | needs-node
	cd web && npm ci --ignore-scripts --no-audit --no-fund

.venv/.installed: $(SOURCES)
	$(PYTHON) -m venv .venv
	.venv/$(PIP) $(TESTED) -e ".[web]"
	touch $@

.venv/.installed-test: $(SOURCES)
	$(PYTHON) -m venv .venv
	.venv/$(PIP) $(TESTED) -e ".[test,tools,web]"
	touch .venv/.installed $@

# The site imports the packages: it is built where the tests run, so that nothing large is installed twice.
.venv/.installed-docs: .venv/.installed-test constraints/docs.txt
	.venv/$(PIP) $(TESTED) -c constraints/docs.txt -e ".[docs]"
	touch $@

# imitation pins older versions of both; the code runs on the newest all the same, so they go on top without its consent.
.venv-newest/.installed-test: $(SOURCES) constraints/newest.txt
	$(PYTHON) -m venv .venv-newest
	.venv-newest/$(PIP) $(TESTED) -e ".[test,tools,web]"
	.venv-newest/$(PIP) --no-deps -r constraints/newest.txt
	touch $@

clean:
	rm -rf .venv .venv-newest docs/_build web/build web/node_modules build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache
	find go1_mtl_gym experts trainers examples experiments tests -name __pycache__ -prune -exec rm -rf {} +
