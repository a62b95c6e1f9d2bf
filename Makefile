# make demo: a character walks to a chair and sits, from nothing.   make test: the linters and all tests.
# make quick: the tests of a minute.
# The bpy modules of Blender 4.2 to 5.0 need Python 3.11, that of 5.2 needs 3.13 and is left out where there is none.

PYTHON ?= $(shell command -v python3.11 || echo python3)
PYTHON_5_2 ?= $(shell python3.13 -c 'import sys; print(sys.executable)' 2>/dev/null || ls $(HOME)/.pyenv/versions/3.13.*/bin/python3.13 2>/dev/null | tail -1)
# Elsewhere plain pip may bring a CUDA build of several GB: name a CPU build here, e.g. TORCH=path/to/torch-…+cpu-….whl
TORCH ?= torch==2.13.0
PIP := bin/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test quick lint zip release repository docs window setup system clean

demo: setup
	.venv/bin/python -m dafnet_addon demo -o out/demo

setup: .venv/.demo

# Blender 4.5, with torch; the others without.
BLENDERS := .venv .venv-4.2 .venv-5.0 $(if $(PYTHON_5_2),.venv-5.2)

test: lint $(BLENDERS:%=%/.test)
	@$(if $(PYTHON_5_2),,echo "Not on Blender 5.2: its module needs Python 3.13 (PYTHON_5_2=path/to/python3.13).")
	$(MAKE) --jobs=2 --output-sync=target --keep-going $(BLENDERS:%=tests-in-%)

# Two suites run at once, on one core each. On 4.5 all tests; on the others those that touch Blender, on 4.2 with the newer NumPy those of
# the core as well.
TOUCH_BLENDER := tests/blender tests/project/test_extension.py tests/test_cli.py tests/test_examples.py
tests-in-.venv-4.2: TESTS = $(TOUCH_BLENDER) tests/core tests/model
tests-in-.venv-5.0 tests-in-.venv-5.2: TESTS = $(TOUCH_BLENDER)
tests-in-%:
	OMP_NUM_THREADS=1 $*/bin/python -m pytest -q $(TESTS)

# What needs neither Blender, nor torch, nor data beside the repository; under a minute.
quick: .venv/.test
	.venv/bin/python -m pytest -q --ignore=tests/blender -m "not (torch or mocap or furniture or slow)"

lint: .venv/.test
	.venv/bin/python -m ruff check .
	.venv/bin/python -m ruff format --check .
	scripts/typecheck.sh .venv/bin/python

zip: .venv/.test
	scripts/build_zip.sh .venv/bin/python

# build/release: the zip, its checksum, what it consists of, what has changed. VERSION=0.2.0 sets the version and cuts the changelog
# first, WEBSITE=… writes the address into the manifest. The commit and the tag are left to you.
release: setup
	.venv/bin/python scripts/release.py $(VERSION) $(if $(WEBSITE),--website $(WEBSITE))

# build/repository: a folder from which Blender installs and updates, over the web or by its file:// address.
repository: zip
	rm -rf build/repository
	scripts/repository.sh .venv/bin/python build/repository build/dafnet-*.zip

# build/site: docs as pages that need nothing from elsewhere; it fails at a dead link.
docs: .venv/.test
	NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --quiet

# Real Blenders (4.3 and 5.2) in windows under a virtual screen, driven with mouse and keys; the pictures of docs/guide.md. As root.
window: setup
	scripts/debian_blender.sh trixie out/blender-4.3
	scripts/window.sh out/window-4.3 out/blender-4.3
	scripts/debian_blender.sh sid out/blender-5.2
	scripts/window.sh docs/guide out/blender-5.2

system:
	@scripts/system_packages.sh $(PYTHON)

.venv/.demo: | system
	$(PYTHON) -m venv .venv
	.venv/$(PIP) 'bpy==4.5.*' 'numpy>=1.26,<2'
	@touch $@

.venv/.test: pyproject.toml .venv/.demo
	.venv/$(PIP) '$(TORCH)' 'numpy>=1.26,<2' matplotlib pytest trimesh rtree scipy safetensors tensorboard ruff mypy hypothesis distributed openjd-cli pyyaml 'mkdocs-material==9.*'
	@touch $@

# Both generations of NumPy are in use, and 4.2 takes either.
.venv-4.2/.test: HOST = 'bpy==4.2.*' 'numpy>=2,<3'
.venv-5.0/.test: HOST = 'bpy==5.0.*' 'numpy>=1.26,<2'
.venv-5.2/.test: HOST = 'bpy==5.2.*' 'numpy>=2,<3'
.venv-5.2/.test: BASE = $(PYTHON_5_2)
.venv-4.2/.test .venv-5.0/.test .venv-5.2/.test: pyproject.toml | system
	$(or $(BASE),$(PYTHON)) -m venv $(@D)
	$(@D)/$(PIP) $(HOST) pytest trimesh rtree scipy hypothesis
	@touch $@

clean:
	rm -rf .venv .venv-4.2 .venv-5.0 .venv-5.2 build out
