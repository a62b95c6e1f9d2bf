#!/usr/bin/env bash
# The extension tool that comes with Blender, in plain Python; $1 is a Python that has the bpy module, the rest goes to the tool.
#
#     scripts/blender_ext.sh PYTHON build --source-dir . --output-dir build
set -euo pipefail

python=$1
packages=$("$python" -c "import sysconfig; print(sysconfig.get_path('purelib'))")
tool=$(echo "$packages"/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)
exec "$python" "$tool" "${@:2}"
