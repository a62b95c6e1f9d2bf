#!/usr/bin/env bash
# Builds and validates the extension with the tool that comes with Blender; $1 is a Python that has the bpy module. Where it has
# MkDocs as well, the guide goes along as pages.
set -euo pipefail

cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}
mkdir -p build
rm -rf build/dafnet-*.zip pages
if "$python" -c "import mkdocs" 2>/dev/null; then
    NO_MKDOCS_2_WARNING=1 "$python" -m mkdocs build --quiet --config-file scripts/pages.yml
    rm -r pages/guide pages/sitemap.xml* # the zip has the pictures beside the guide's source
    sed -i 's#src="guide/#src="../docs/guide/#g' pages/*.html
fi
scripts/blender_ext.sh "$python" build --source-dir . --output-dir build
scripts/blender_ext.sh "$python" validate build/dafnet-*.zip
ls -lh build/dafnet-*.zip
