#!/usr/bin/env bash
# Builds and validates the extension with the tool that comes with Blender; $1 is a Python that has the bpy module.
set -euo pipefail

cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}
mkdir -p build
rm -f build/dafnet-*.zip
scripts/blender_ext.sh "$python" build --source-dir . --output-dir build
scripts/blender_ext.sh "$python" validate build/dafnet-*.zip
ls -lh build/dafnet-*.zip
