#!/usr/bin/env bash
# Type-checks the project as Blender sees it, one package around the repository's root, and the benchmarks as scripts.
set -euo pipefail

cd "$(dirname "$0")/.."
root=$PWD
python=$(realpath -s "${1:-.venv/bin/python}")
parent=$(mktemp -d)
trap 'rm -rf "$parent"' EXIT
ln -s "$root" "$parent/dafnet"

(cd "$parent" && "$python" -m mypy --config-file "$root/pyproject.toml" --cache-dir "$root/.mypy_cache/extension" \
    -p dafnet.operators -p dafnet.panels -p dafnet.dafnet_addon)
"$python" -m mypy --explicit-package-bases benchmarks
