#!/usr/bin/env bash
# Type-checks the project as Blender loads it, what the tests share with it, and the benchmarks as scripts.
set -euo pipefail

cd "$(dirname "$0")/.."
root=$PWD
python=$(realpath -s "${1:-.venv/bin/python}")
parent=$(mktemp -d)
trap 'rm -rf "$parent"' EXIT
mkdir -p "$parent/bl_ext/user_default"
touch "$parent/bl_ext/__init__.py" "$parent/bl_ext/user_default/__init__.py"
ln -s "$root" "$parent/bl_ext/user_default/dafnet"
ln -s "$root/tests/kit" "$root/dafnet_addon" "$parent/"
extension=bl_ext.user_default.dafnet

(cd "$parent" && "$python" -m mypy --config-file "$root/pyproject.toml" --cache-dir "$root/.mypy_cache/extension" \
    -p $extension.operators -p $extension.panels -p $extension.dafnet_addon -p kit)
"$python" -m mypy --explicit-package-bases benchmarks
