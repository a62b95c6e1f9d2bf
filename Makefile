# make demo: a character walks to a chair and sits, from nothing.   make test: everything, on three Blenders.
# make quick: the tests of a minute.
# The bpy modules of Blender 4.2 to 5.0 need Python 3.11.

PYTHON ?= $(shell command -v python3.11 || echo python3)
# Elsewhere plain pip may bring a CUDA build of several GB: name a CPU build here, e.g. TORCH=path/to/torch-…+cpu-….whl
TORCH ?= torch==2.13.0
PIP := bin/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test quick lint zip release repository docs window setup system clean

demo: setup
	.venv/bin/python -m dafnet_addon demo -o out/demo

setup: .venv/.demo

test: lint .venv-4.2/.test .venv-5.0/.test
	.venv/bin/python -m pytest -q
	.venv-4.2/bin/python -m pytest -q
	.venv-5.0/bin/python -m pytest -q

# What needs neither Blender, nor torch, nor data beside the repository; under a minute.
quick: .venv/.test
	.venv/bin/python -m pytest -q --ignore=tests/blender -m "not (torch or mocap or furniture or slow)"

lint: .venv/.test
	.venv/bin/python -m ruff check .
	.venv/bin/python -m ruff format --check .
	scripts/typecheck.sh .venv/bin/python

zip: setup
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

# Both generations of NumPy are in use: 4.2 takes either.
.venv-4.2/.test: HOST = 'bpy==4.2.*' 'numpy>=2,<3'
.venv-5.0/.test: HOST = 'bpy==5.0.*' 'numpy>=1.26,<2'
.venv-4.2/.test .venv-5.0/.test: pyproject.toml | system
	$(PYTHON) -m venv $(@D)
	$(@D)/$(PIP) $(HOST) pytest trimesh rtree scipy hypothesis
	@touch $@

clean:
	rm -rf .venv .venv-4.2 .venv-5.0 build out
