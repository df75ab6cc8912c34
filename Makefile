# Everything runs from .venv/, made from requirements.lock (hashes checked). Needs Python >= 3.11 and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DEMO_ARGS ?=
PYTEST_ARGS ?=

.PHONY: setup demo fleet fleet-flights test thorough mutants lint style format errors pictures worlds generate lock clean conformance history simulate mutation edges fuzz soak full-disk chaos links bench bench-against flight-tests fault-detection campaign paper containers containers-test

setup: $(READY)
	$(if $(filter setup,$(MAKECMDGOALS)),@echo "$(VENV)/ is ready. Try: $(BIN)/skillwing demo")

# A step is repeated only if the content of its file has changed: a checkout that touches the files costs nothing.
PIP := $(BIN)/python -m pip install --disable-pip-version-check
UNCHANGED = cmp --silent $(1) $(VENV)/.$(notdir $(1)) ||
$(READY): requirements.lock pyproject.toml
	@echo "Step 1 of 3: Python environment in $(VENV)/"
	@$(PYTHON) -c 'import sys; sys.exit("Skillwing needs Python 3.11 or newer; this is " + sys.version.split()[0] + ". Try: make PYTHON=python3.12" if sys.version_info < (3, 11) else 0)'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Step 2 of 3: $$(grep -c == requirements.lock) packages of requirements.lock, hashes checked (1.9 GB and about two minutes, once)"
	@$(call UNCHANGED,requirements.lock) { $(PIP) --require-hashes -r requirements.lock && cp requirements.lock $(VENV)/.requirements.lock; }
	@echo "Step 3 of 3: skillwing, from this folder"
	@$(call UNCHANGED,pyproject.toml) { $(PIP) --quiet --no-deps --no-build-isolation --editable . && cp pyproject.toml $(VENV)/.pyproject.toml; }
	@touch $@

demo: setup
	$(BIN)/skillwing demo $(DEMO_ARGS)

# Two drones in one world, each with a system of its own, over real processes. FLEET_ARGS="--condition camera --speed max".
FLEET_ARGS ?=
fleet: setup
	$(BIN)/python -m skillwing.evaluation.fleet.demo $(FLEET_ARGS)

# Flights of two drones over seeds and conditions, into docs/reliability.md: about two hours of processor time.
FLEET_FLIGHTS_ARGS ?= --seeds 20 --jobs 2
fleet-flights: setup
	$(BIN)/python benchmarks/fleet_flights.py $(FLEET_FLIGHTS_ARGS) --write

# One worker a core and two more. What starts processes stays with two of them (tests/scheduling.py), and begins first: if
# files were sorted by how many tests they have, those of few long flights would come last and keep one worker while
# others are idle.
# What Python has compiled is kept, also where the environment says otherwise: hundreds of processes start twice as fast.
# Libraries below numpy have one thread: theirs would take the cores of the other workers (processes/child.py).
PYTEST := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder
# The type checker is part of `make lint`, which CI runs before the tests: it takes a tenth of their processor time.
test: style
	$(PYTEST) $(PYTEST_ARGS)

# Forty times as many examples for each law, unless it sets their number by `settings` itself.
thorough: setup
	$(PYTEST) --hypothesis-profile thorough tests/unit tests/scenarios $(PYTEST_ARGS)

# Broken variants of every example file: whatever is typed, there are diagnostics and never a traceback.
mutants: setup
	$(BIN)/python tests/unit/dsl/skillset_mutants.py --write docs/reliability.md $(MUTANTS_ARGS)

lint: style
	$(BIN)/basedpyright --warnings

style: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The figures in docs/performance.md, for the better or the worse; on a quiet machine, for seven minutes.
bench: setup
	$(BIN)/python benchmarks/latency.py --write
	$(BIN)/python benchmarks/recovery.py --write
	$(BIN)/python benchmarks/managers.py --write
	$(BIN)/python benchmarks/keys.py --write
	$(BIN)/python benchmarks/messages.py --write
	$(BIN)/python benchmarks/tree_tick.py --write
	$(BIN)/python benchmarks/language.py --write
	$(BIN)/python benchmarks/command_line.py --write
	$(BIN)/python benchmarks/campaign_speed.py --write
	$(BIN)/python benchmarks/flight_pools.py --write
	$(BIN)/python benchmarks/sim_speed.py --write
	$(BIN)/python benchmarks/ray_choices.py --write
	$(BIN)/python benchmarks/stack_speed.py --write

# This version and an earlier one in turns, from messages to flights, for half an hour: make bench-against REV=v0.1.0
AGAINST_ARGS ?=
bench-against: setup
	$(BIN)/python benchmarks/bench_against.py $(or $(REV),$(error Name the other version: make bench-against REV=...)) $(AGAINST_ARGS)

# How well the simulated drone flies, over seeds: figures and pictures in docs/flight.md. FLIGHT_ARGS=rotors for a part.
FLIGHT_ARGS ?=
flight-tests: setup
	$(BIN)/python benchmarks/flight_tests.py --seeds 5 --write $(FLIGHT_ARGS)

# What follows from the code in docs/errors/: headings, the output under each example, the index.
errors: setup
	$(BIN)/python tests/unit/dsl/error_pages.py

# Every fault of every sensor: noticed or not, and how soon.
fault-detection: setup
	$(BIN)/python benchmarks/fault_detection.py --seeds 20 --minutes 2 --missions 30 --write

# The pictures in README.md, from flights of this very code. Those of the dashboard need a Vulkan driver, no screen.
pictures: setup
	rm -rf runs/pictures
	$(BIN)/skillwing demo --viewer none --run-dir runs/pictures/mapping
	$(BIN)/skillwing demo inspection --viewer none --run-dir runs/pictures/inspection; test $$? -eq 1 # it loses its link
	$(BIN)/python -m skillwing.evaluation.fleet.demo --condition camera --run-dir runs/pictures/fleet
	cp runs/pictures/mapping/timeline.png runs/pictures/mapping/map.png docs/images/
	cp runs/pictures/fleet/fleet.png docs/images/
	$(BIN)/python benchmarks/dashboard_picture.py runs/pictures/fleet/left/recording.rrd docs/images/dashboard-fleet.png --at 45
	$(BIN)/python benchmarks/dashboard_picture.py runs/pictures/mapping/recording.rrd docs/images/dashboard-mapping.png --at 47
	$(BIN)/python benchmarks/dashboard_picture.py runs/pictures/inspection/recording.rrd docs/images/dashboard-inspection.png --at 50

# The gallery in docs/worlds.md. Nothing is flown for it.
worlds: setup
	mkdir -p docs/images/worlds
	for kind in courtyard street village industrial inspection; do \
		$(BIN)/skillwing world $$kind -o docs/images/worlds/$$kind.png || exit 1; done

# Cases of the wire protocol, on every kind of manager and in every layout of processes, for three minutes.
conformance: setup
	$(BIN)/python tests/conformance/conformance_run.py --write docs/reliability.md

# Histories of the real resource manager, asked by several clients and killed, checked for linearizability.
HISTORY_ARGS ?= --seconds 60
history: setup
	$(BIN)/python tests/history/history_run.py $(HISTORY_ARGS)

# Bad input to every key of everything that runs, and 100,000 goals that nobody may remember.
FUZZ_ARGS ?=
fuzz: setup
	$(BIN)/python tests/fuzz/fuzz_run.py --write docs/reliability.md $(FUZZ_ARGS)
	SOAK_GOALS=100000 $(BIN)/python -m pytest -q --timeout 900 tests/fuzz/test_memory_is_bounded.py

# Mocks for a robot day, faster than wall time: memory of each process, and disk. Two and a half hours of two quiet cores.
# Ctrl-C ends it with a table of what was measured. A soak in runs/soak that the same code has finished does not run again.
SOAK_ARGS ?= --hours 24 --rate 20 --speed 20 --mission-hours 0.75
soak: setup
	$(BIN)/python tests/soak/soak_run.py --results runs/soak --write docs/reliability.md --write-rates docs/recordings.md $(SOAK_ARGS)

# A disk that is full for a minute, six times on mocks and once in a flight: root, and a quarter of an hour.
FULL_DISK_ARGS ?=
full-disk: setup
	PYTHONPATH=tests $(BIN)/python tests/soak/full_disk_run.py --write docs/reliability.md $(FULL_DISK_ARGS)

# kill -9 and SIGSTOP of every process in every state of a goal, and in flight. CHAOS_ARGS=--managers for half of it.
CHAOS_ARGS ?=
chaos: setup
	PYTHONPATH=tests $(BIN)/python tests/chaos/chaos_run.py --write docs/reliability.md $(CHAOS_ARGS)

# The link between a flying robot and its station, cut at every moment, in network namespaces: root, and an hour. What was
# flown is not flown again.
LINKS_ARGS ?=
links: setup
	$(BIN)/python tests/links/links_run.py --results runs/links.jsonl --write docs/reliability.md $(LINKS_ARGS)

# All the tables in docs/missions.md, a campaign each: hours. A broken promise does not keep the others from being flown,
# and what was interrupted goes on. The flights lie beside the page that tells them. Other code begins again, with the
# folders of the old flights removed, or into others: CAMPAIGN_DIR=runs/NAME.
CAMPAIGN_DIR ?= docs/campaigns
CAMPAIGN_ARGS ?=
CAMPAIGN := $(BIN)/skillwing campaign
CAMPAIGN_PAGE = --resume --write docs/missions.md $(CAMPAIGN_ARGS) -o $(CAMPAIGN_DIR)
CAMPAIGNS := campaign-mapping campaign-returns campaign-instruments campaign-worlds campaign-inspection campaign-unwatched campaign-again campaign-zenoh
.PHONY: $(CAMPAIGNS)
campaign: setup
	$(MAKE) --keep-going --jobs=1 $(CAMPAIGNS)

campaign-mapping: setup
	$(CAMPAIGN) mapping --seeds 0:100 --faults none,camera,lidar,both,gust,battery,pilot --worst 3 $(CAMPAIGN_PAGE)/mapping

# Held and resumed: the mission goes on as without a fault, so fewer flights tell as much.
campaign-returns: setup
	$(CAMPAIGN) mapping --seeds 0:20 --faults pilot-returns $(CAMPAIGN_PAGE)/returns

# What the drone knows its place and height by, and what carries it.
campaign-instruments: setup
	$(CAMPAIGN) mapping --seeds 0:20 --faults gnss,imu,range,rotor $(CAMPAIGN_PAGE)/instruments

# Those that have more in them than a courtyard.
campaign-worlds: setup
	$(CAMPAIGN) mapping --seeds 0:5 --worlds street,village,industrial --faults none,camera,both,gust $(CAMPAIGN_PAGE)/worlds

campaign-inspection: setup
	$(CAMPAIGN) inspection --seeds 0:5 --faults all $(CAMPAIGN_PAGE)/inspection

# What obstacle detection is worth: that drones collide here is no failure.
campaign-unwatched: setup
	$(CAMPAIGN) mapping --seeds 0:20 --faults none --without-obstacles $(CAMPAIGN_PAGE)/unwatched || test $$? -eq 1

# Whether flights are the same by the code of today.
campaign-again: setup
	$(CAMPAIGN) mapping --sample-of $(CAMPAIGN_DIR)/mapping --sample 70 $(CAMPAIGN_PAGE)/again

# Whether flights with real processes end as those in one process did, by the same code.
campaign-zenoh: setup
	$(CAMPAIGN) mapping --sample-of $(CAMPAIGN_DIR)/again --sample 20 --on zenoh $(CAMPAIGN_PAGE)/zenoh

# Both scenarios of the paper, nominal and failing, into docs/results.md: an hour of one core, and it goes on where it
# was interrupted. PAPER_ARGS="--seeds 0:20 --jobs 2" for more flights.
PAPER_ARGS ?=
paper: setup
	$(BIN)/python benchmarks/paper/run.py $(PAPER_ARGS)

# docker-compose.yml on the engine that answers here: builds the images, and flies in them. Minutes, most of them builds.
containers-test: setup
	SKILLWING_CONTAINERS_TEST=1 $(BIN)/python -m pytest -v -rs tests/integration/test_containers.py $(PYTEST_ARGS)

# How large the images are, and how the system stands in them, into docs/containers.md.
containers: setup
	$(BIN)/python benchmarks/containers.py --write

# Everything that follows from the code without a measurement: the robot's package, pages, services in containers.
M600 := services/skillwing/m600
generate: setup errors
	$(BIN)/skillwing generate $(M600)/m600.skillset -o $(M600) --no-skeletons
	$(BIN)/skillwing docs $(M600)/m600.skillset -o docs/m600.md
	$(BIN)/python tests/unit/dsl/grammar_files.py
	$(BIN)/python tests/unit/cli/cli_page.py
	$(BIN)/python tests/unit/access/roles_page.py
	$(BIN)/python tests/edges/edges_run.py --table --write docs/semantics.md
	$(BIN)/python tests/unit/m600/compose_services.py
	$(BIN)/skillwing protocol > docs/protocol.md.new && mv docs/protocol.md.new docs/protocol.md
	$(BIN)/skillwing functional-layer > docs/functional-layer.md.new && mv docs/functional-layer.md.new docs/functional-layer.md

# Locks hold hashes and no addresses; `uv` is needed only here. requirements.lock is everything a developer
# needs; locks/ holds what the container images need, by role, in the same versions.
COMPILE := uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	--no-emit-index-url --no-emit-find-links --quiet

lock:
	$(COMPILE) pyproject.toml --all-extras --group dev -o requirements.lock
	$(COMPILE) pyproject.toml -c requirements.lock -o locks/manager.lock
	$(COMPILE) pyproject.toml --extra onboard -c requirements.lock -o locks/onboard.lock
	$(COMPILE) pyproject.toml --extra sim -c requirements.lock -o locks/sim.lock
	echo numpy | $(COMPILE) pyproject.toml - --extra missions -c requirements.lock -o locks/mission.lock
	echo rerun-sdk | $(COMPILE) pyproject.toml - -c requirements.lock -o locks/recorder.lock
	echo "hatchling>=1.26" | $(COMPILE) - -c requirements.lock -o locks/build.lock

# Managers and clients on a failing network: RUNS seeds, or the story of one SEED (SHRINK=1: of its essence).
RUNS ?= 2000
simulate: setup
	PYTHONPATH=tests $(BIN)/python -m simulation $(if $(SEED),--seed $(SEED) -v $(if $(SHRINK),--shrink),--runs $(RUNS) $(SIMULATE_ARGS))

# Mutants of the managers' cores, and which tests kill them; goes on where it was interrupted.
MUTATION_ARGS ?= --seconds 3600
mutation: setup
	$(BIN)/python tests/mutation/mutation_run.py --write docs/reliability.md $(MUTATION_ARGS)

# The table of a goal's states in docs/semantics.md, and how often tests, simulated runs and flights take each edge of it.
EDGES_ARGS ?=
edges: setup
	$(BIN)/python tests/edges/edges_run.py --write docs/semantics.md $(EDGES_ARGS)

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis
