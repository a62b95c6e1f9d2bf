#!/usr/bin/env bash
# Builds and validates the extension with the tool that comes with Blender; $1 is a Python that has the bpy module.
set -euo pipefail

cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}
packages=$("$python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
tool=$(echo "$packages"/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)
mkdir -p build
rm -f build/dafnet-*.zip
"$python" "$tool" build --source-dir . --output-dir build
"$python" "$tool" validate build/dafnet-*.zip
ls -lh build/dafnet-*.zip
