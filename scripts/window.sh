#!/usr/bin/env bash
# Drives a real Blender in a window under a virtual screen with mouse and keys, as tests/window/drive.py says, in a fresh profile.
# Its pictures go to a folder. The Blender is one on the PATH, or lies in a Debian made by scripts/debian_blender.sh.
# All parts of drive.py are played, or those that are named.
#
#     [RIGS=FOLDER] scripts/window.sh PICTURES [DEBIAN [PART...]]
#
# RIGS is a folder of real characters' rest poses, of which two are baked on.
set -euo pipefail

cd "$(dirname "$0")/.."
pictures=$(realpath -m "$1") debian=${2:-} parts=("${@:3}")
scripts/build_zip.sh .venv/bin/python >/dev/null
work=$(mktemp -d "${debian:-}/tmp/dafnet.XXXXXX")
trap 'rm -rf "$work"; [[ -z ${mounted:-} ]] || umount "$debian/proc"' EXIT
cp build/dafnet-*.zip "$work/dafnet.zip"
cp -r tests/window "$work/drive"
cp -r tests/kit "$work/drive/"
mkdir "$work/drive/rigs"
for rig in mixamo_gltf_woman vrm_b; do
    if [[ -n ${RIGS:-} ]]; then cp "$RIGS/$rig.json" "$work/drive/rigs/"; fi
done
mkdir -p "$work/profile/extensions/user_default" "$work/pictures"
inside=${work#"$debian"}
run=(env HOME="$inside" BLENDER_USER_RESOURCES="$inside/profile" LIBGL_ALWAYS_SOFTWARE=1)
if [[ -n $debian ]]; then
    mountpoint -q "$debian/proc" || { mount -t proc proc "$debian/proc"; mounted=1; }
    run=(chroot "$debian" "${run[@]}")
fi
if [[ ${parts[*]} == stranger ]]; then # installs it from a repository's address
    scripts/repository.sh .venv/bin/python "$work/repository" build/dafnet-*.zip >/dev/null
else
    "${run[@]}" blender --command extension install-file -r user_default -e "$inside/dafnet.zip" >/dev/null
fi
"${run[@]}" xvfb-run -a -s "-screen 0 1600x1000x24 +extension GLX" blender --enable-event-simulate --no-window-focus \
    --python-exit-code 1 --window-geometry 0 0 1600 1000 --python "$inside/drive/drive.py" -- "$inside/pictures" "${parts[@]}" 2>&1 |
    tee "$work/log"
mkdir -p "$pictures"
find "$work/pictures" -name "*.png" -exec cp -t "$pictures" {} +
grep -q "^Driven to the end" "$work/log"
