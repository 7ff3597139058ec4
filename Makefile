# `make demo` and `make test` each build everything they need into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUST_SOURCES := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock

.PHONY: build demo test proof lint format bench fuzz clean constraints

# The participant of ROS 2 on another DDS, a workspace of its own: only tests and lint need it.
PROOF := --manifest-path ros2/proof/Cargo.toml

build: $(VENV)/.built

$(VENV)/.installed: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("planegrasp needs Python 3.11 or newer, this is " + sys.version.split()[0] + "; choose another: make PYTHON=python3.12 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade -c constraints.txt pip
	$(BIN)/python -m pip install --quiet --upgrade -c constraints.txt maturin setuptools
	@touch $@

$(VENV)/.built: $(VENV)/.installed $(RUST_SOURCES)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pip install --quiet -c constraints.txt --no-build-isolation -e ".[dev]"
	@touch $@

demo: build
	$(BIN)/planegrasp demo --output out/demo

test: build proof
	cargo test --release --package planegrasp-core --all-features --quiet
	$(BIN)/python -m pytest -n 2 -q

proof:
	cargo build --release --locked --quiet $(PROOF)

lint: build
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	cargo fmt --check
	cargo clippy --release --workspace --all-targets --quiet -- -D warnings
	cargo fmt --check $(PROOF)
	cargo clippy --release --locked --quiet $(PROOF) -- -D warnings

format: build
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	cargo fmt
	cargo fmt $(PROOF)

bench: build
	for name in tilt objects pose negatives grasp; do \
		$(BIN)/planegrasp bench $$name --json out/bench/$$name.json || exit 1; done

# Half a minute a target, with nightly Rust and cargo-fuzz; CONTRIBUTING.md says more.
FUZZ_SECONDS ?= 30
fuzz:
	cd rust/core && for target in sift surf matching homography face_search alignment; do \
		cargo +nightly fuzz run $$target -- -max_total_time=$(FUZZ_SECONDS) -timeout=20 \
			-max_len=4096 -len_control=0 || exit 1; done

# Resolve the pinned versions anew, without any index address in the file.
constraints: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile --quiet --universal --no-emit-index-url --no-header --no-annotate --python-version 3.11 \
		--all-extras pyproject.toml constraints.in -o constraints.txt

clean:
	rm -rf $(VENV) target ros2/proof/target out
