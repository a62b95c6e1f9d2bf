#!/usr/bin/env bash
# Makes a static extension repository of zips: a folder that any web server can hand out, and that Blender also takes by its file://
# address (Preferences > Get Extensions > Repositories > Add Remote Repository, the address of its index.json). It has an index.html
# for people. Of several zips the newest version is the one that Blender offers.
#
#     scripts/repository.sh PYTHON FOLDER ZIP...
set -euo pipefail

here=$(dirname "$0")
python=$1 folder=$2
mkdir -p "$folder"
cp "${@:3}" "$folder/"
"$here/blender_ext.sh" "$python" server-generate --repo-dir "$folder" --html
