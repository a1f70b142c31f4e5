# Everything is set up in .venv by itself. PYTHON chooses another interpreter, which gets a folder of its own.
PYTHON ?= python3
VENV := .venv$(if $(filter-out python3,$(notdir $(PYTHON))),-$(notdir $(PYTHON)))
RUN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: map test smoke lint samples figures pictures reference bench growth robustness lasers consistency strangers soak lowest lock clean

map: $(READY)
	mkdir -p out
	$(RUN)/nscan-cli slam sample_logs/office.log.gz -o out/office.json --map out/office.png

test: $(READY)
	$(RUN)/python -m pytest -n 2

# What depends on the version of Python most: all that is read and written, and every command.
smoke: $(READY)
	$(RUN)/python -m pytest -n 2 tests/logs tests/graph tests/evaluation tests/exports tests/mapping tests/cli tests/docs

lint: $(READY)
	$(RUN)/ruff check
	$(RUN)/ruff format --check
	$(RUN)/mypy

samples: $(READY)
	$(RUN)/python -m tests.simulation.make_samples sample_logs

figures: $(READY)
	$(RUN)/python -m tests.experiments docs/pictures

pictures: $(READY)
	$(RUN)/python -m tests.pictures docs/pictures

reference: $(READY)
	$(RUN)/python -m tests.reference docs/reference.md

bench: $(READY)
	mkdir -p out
	$(RUN)/python -m tests.benchmarks out/bench.json

growth: $(READY)
	mkdir -p out
	$(RUN)/python -m tests.benchmarks.growth out/growth.json docs/pictures/growth.png

robustness: $(READY)
	$(RUN)/python -m tests.benchmarks.robustness docs/robustness.md

consistency: $(READY)
	$(RUN)/python -m tests.benchmarks.consistency docs/consistency.md

lasers: $(READY)
	$(RUN)/python -m tests.benchmarks.lasers docs/lasers.md

strangers: $(READY)
	$(RUN)/python -m tests.benchmarks.strangers docs/strangers.md

soak: $(READY)
	mkdir -p out
	$(RUN)/python -m tests.soak --seconds 180 --runs 120
	$(RUN)/python -m tests.soak.kills --kills 50
	$(RUN)/python -m tests.soak.trouble
	$(RUN)/python -m pytest -n 2 -m hypothesis --hypothesis-profile random

lowest:
	$(PYTHON) -m venv out/lowest
	out/lowest/bin/python -m pip install --quiet --disable-pip-version-check -r requirements-lowest.txt \
	  pytest hypothesis jsonschema foxglove-schemas-protobuf mcap-protobuf-support mcap-ros1-support mcap-ros2-support
	PYTHONPATH=$(CURDIR) out/lowest/bin/python -m pytest tests --ignore tests/soak --ignore tests/nightly \
	  --ignore tests/slam --ignore tests/experiments --ignore tests/simulation

lock: $(READY)
	$(RUN)/python -m pip freeze --exclude-editable > requirements-dev.lock

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(RUN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	# Where Python may write no bytecode, every run would else compile the package first.
	$(RUN)/python -m compileall -q nscan_cli
	touch $@

clean:
	rm -rf .venv .venv-* out
