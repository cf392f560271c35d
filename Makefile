# make demo: pictures from nothing. make test: lint, types and tests; make test-fast: the tests that need no device, and
# a few that do; make test-gpu: what a graphics card has to show; make golden-diff: by how much the golden pictures moved;
# make golden: these anew; make fuzz: ten minutes of broken input; make docs: the reference of
# all classes and functions. All set everything up first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Most of the time goes to compilers that use one core. Each process takes neighbouring tests, which share programs.
PYTEST := $(BIN)/pytest --numprocesses auto --maxprocesses 4 --dist worksteal
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test test-fast test-slow test-gpu golden golden-diff fuzz docs lint setup setup-test lock clean

demo: setup
	@mkdir -p out
	$(BIN)/pica demo --sheet -o out/demo.png

test: setup-test lint
	$(PYTEST) -m "not (slow or whole_frames)"

test-fast: setup-test
	$(PYTEST) -m "not (slow or device or thorough) or smoke"

test-slow: setup-test
	$(PYTEST) -m "slow or whole_frames"

# On a graphics card, without assets. Tests that differ there for a known reason (gpu_differs) may fail.
test-gpu: setup-test
	$(PYTEST) --graphics-card -m "device and not (slow or assets)"

# GOLDEN="cornell indirect" are these only, by their names or by how those begin; DEVICE=H200: on this device.
golden-diff: setup-test
	$(BIN)/python -m tests.golden.difference $(if $(DEVICE),--device "$(DEVICE)") $(GOLDEN)

golden: setup-test
	$(BIN)/python -m tests.golden.renew $(GOLDEN)

# MINUTES=60 goes on for longer.
MINUTES ?= 10
fuzz: setup-test
	$(BIN)/python -m tests.fuzz.campaign --minutes $(MINUTES)

# A warning is an error.
docs: $(VENV)/installed-docs
	$(BIN)/python -m tools.api_reference out/docs

lint: setup-test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

setup: $(VENV)/installed
	@scripts/setup_vulkan.sh $(BIN)/python
	@scripts/setup_embree.sh $(BIN)/python

setup-test: $(VENV)/installed-test setup
	@scripts/setup_llvm.sh

$(BIN)/python:
	@scripts/setup_venv.sh $(PYTHON) $(VENV)

$(VENV)/installed: requirements.lock requirements-denoise.lock pyproject.toml | $(BIN)/python
	@echo "pica: installing the package and its dependencies into $(VENV)"
	@$(PIP) -r requirements.lock
	@$(PIP) --no-deps --no-build-isolation --editable .
	@$(PIP) --only-binary :all: -r requirements-denoise.lock || \
		echo "pica: Open Image Denoise cannot be installed here, so pictures cannot be denoised"
	@touch $@

$(VENV)/installed-test: requirements-test.lock $(VENV)/installed
	@echo "pica: installing the test tools into $(VENV)"
	@$(PIP) -r requirements-test.lock
	@touch $@

$(VENV)/installed-docs: requirements-docs.lock $(VENV)/installed
	@$(PIP) -r requirements-docs.lock
	@touch $@

# The newest versions that pyproject.toml allows, for everybody who runs make.
lock:
	@scripts/lock.sh $(PYTHON)

clean:
	rm -rf $(VENV) out
