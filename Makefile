# Underfoot: `make run` opens it, `make test` tries it. Both make .venv and install what is missing. `make check` is the
# short form of the tests, `make bench-short` says how long things take, `make docs` builds the site.

PYTHON ?= python3
# Modules are kept as bytecode: every process that a session or a test starts would compile them again.
export PYTHONDONTWRITEBYTECODE :=
BIN := .venv/bin
# A test that hangs is ended (pyproject.toml), and its process with it: it is not tried again in another.
ONCE := --max-worker-restart 0
# Threads of the linear algebra in each of several processes would wait for each other: a sixth of such tests' time.
PYTEST := OPENBLAS_NUM_THREADS=1 QT_QPA_PLATFORM=offscreen $(BIN)/python -m pytest
TOUR := underfoot-tour
RUN_PACKAGES := libgl1 libegl1 libxkbcommon0 libfontconfig1 libdbus-1-3 libglib2.0-0 libxkbcommon-x11-0 \
	libxcb-cursor0 libxcb-icccm4 libxcb-keysyms1 libxcb-shape0 libportaudio2 fonts-dejavu-core
TEST_PACKAGES := pulseaudio pulseaudio-utils libasound2-plugins

# What `make check` tries: what needs no window, no sound card and no session, and does not compute for long; and the
# examples in docstrings.
SOURCES := .venv/as-installed/underfoot
QUICK := $(addprefix tests/,nodes patch floor drawing records models/tile) $(wildcard tests/models/*.py) \
	$(addprefix tests/test_,bad_input.py docs.py files.py imports.py layouts.py presets.py) \
	--ignore tests/nodes/test_stickslip.py --ignore tests/records/test_exports.py \
	$(SOURCES) --ignore $(SOURCES)/bench --ignore $(SOURCES)/widgets

.PHONY: install run test check lint docs bench bench-short clean

install: .venv/ready

run: .venv/ready
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then exec $(BIN)/underfoot; else $(MAKE) --no-print-directory tour; fi

# Five processes on two cores: tests of windows, sessions and devices wait for much of their time.
test: lint
	$(PYTEST) --numprocesses 5 $(ONCE)

check: lint
	$(PYTEST) --numprocesses 2 $(ONCE) $(QUICK)

# Status 2 is a failure of mypy itself: where a process of its does not answer within 3 s, it works with one.
lint: .venv/ready .venv/ready-test as-installed
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/mypy --num-workers 2 || { [ $$? = 2 ] && $(BIN)/mypy; }

docs: .venv/ready .venv/ready-docs as-installed
	$(BIN)/mkdocs build --quiet
	@echo "The documentation is in site/index.html. Its search needs a server: python3 -m http.server -d site"

bench: .venv/ready
	$(BIN)/underfoot bench

bench-short: .venv/ready
	$(BIN)/underfoot bench --short

# The folders under the names that they are installed by: what mypy and doctests read.
.PHONY: as-installed
as-installed:
	@mkdir -p .venv/as-installed/underfoot
	@find "$(CURDIR)/workbench" -mindepth 1 -maxdepth 1 ! -name __pycache__ -exec ln -sfn {} .venv/as-installed/underfoot/ ';'
	@ln -sfn "$(CURDIR)/widgets" "$(CURDIR)/presets" "$(CURDIR)/assets" .venv/as-installed/underfoot/

# With no display: what the window would show, as files.
.PHONY: tour
tour:
	@echo "There is no display; a tour goes to $(TOUR)/ instead."
	@mkdir -p $(TOUR) && rm -f $(TOUR)/*
	$(BIN)/underfoot render presets/patches/gravel.json --seconds 10 -o $(TOUR)/gravel.wav
	$(BIN)/underfoot monitor simulator --patch presets/patches/gravel.json --seconds 8 --record $(TOUR)/walk.underfoot --steps $(TOUR)/steps.csv
	QT_QPA_PLATFORM=offscreen $(BIN)/underfoot --patch presets/patches/gravel.json --recording $(TOUR)/walk.underfoot --screenshot $(TOUR)
	@ls $(TOUR)

.venv/ready: pyproject.toml
	@$(call debian,python3-venv $(RUN_PACKAGES))
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/ready-test: pyproject.toml .venv/ready
	@$(call debian,$(TEST_PACKAGES))
	$(BIN)/pip install --quiet --disable-pip-version-check --editable ".[test]"
	@touch $@

.venv/ready-docs: pyproject.toml .venv/ready
	$(BIN)/pip install --quiet --disable-pip-version-check --editable ".[docs]"
	@touch $@

clean:
	rm -rf .venv $(TOUR) build site *.egg-info

# Debian packages that are missing: installed where that is allowed, else named in one line.
define debian
if command -v dpkg-query >/dev/null; then \
	missing=""; \
	for package in $(1); do \
		dpkg-query -W -f='$${Status}' $$package 2>/dev/null | grep -q "ok installed" || missing="$$missing $$package"; \
	done; \
	if [ -n "$$missing" ]; then \
		sudo=""; [ "$$(id -u)" = 0 ] || sudo="sudo -n"; \
		if ! { $$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends $$missing; } >/dev/null 2>&1; then \
			echo "These Debian packages are missing, and could not be installed from here:$$missing"; \
		fi; \
	fi; \
fi
endef
