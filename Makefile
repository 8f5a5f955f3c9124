STUDY ?= config/lift_angle.yaml
CORES ?= 2
PYTHON ?= python3
BIN := .venv/bin
UV := .uv/bin/uv

.PHONY: sweep setup test bench lint clean

sweep: setup
	@$(BIN)/simcore check $(STUDY)
	@$(BIN)/snakemake --profile workflow/profiles/default --cores $(CORES) --config study=$(STUDY)
	@echo "report: results/$(basename $(notdir $(STUDY)))/report.html"

setup: .venv/installed

test: setup
	$(BIN)/python -m pytest --numprocesses $(CORES) --dist loadfile --no-loadscope-reorder

bench: setup
	$(BIN)/python -m benchmarks

lint: setup
	$(BIN)/ruff check .

clean:
	rm -rf .venv .uv .snakemake results build *.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +

# uv comes by pip into a folder of its own; the environment is exactly the lock's.
.venv/installed: requirements.lock pyproject.toml | $(UV)
	$(UV) venv --quiet --allow-existing --python $(PYTHON) .venv
	VIRTUAL_ENV=.venv $(UV) pip sync --quiet --compile-bytecode --require-hashes requirements.lock
	VIRTUAL_ENV=.venv $(UV) pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(UV): requirements.uv.lock
	$(PYTHON) -m venv .uv
	.uv/bin/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.uv.lock
	touch $@
