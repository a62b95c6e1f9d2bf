#!/usr/bin/env bash
# A real Blender with its window under a virtual screen, in a Debian of its own: trixie has Blender 4.3, sid has 5.2. As root.
#
#     scripts/debian_blender.sh trixie build/blender-4.3
set -euo pipefail

suite=$1 folder=$2
command -v debootstrap >/dev/null || { apt-get update -qq; apt-get install -y -qq debootstrap >/dev/null; }
[[ -e $folder/.ready ]] && exit 0
mkdir -p "$folder"
[[ -e $folder/usr/bin/apt-get ]] || debootstrap --variant=minbase "$suite" "$folder" >"$folder.log"
cp /etc/resolv.conf "$folder/etc/"
# Certificates of this machine's own network reach into it as well.
[[ -d /usr/local/share/ca-certificates ]] && mkdir -p "$folder/usr/local/share" && cp -r /usr/local/share/ca-certificates "$folder/usr/local/share/"
ln -sfn /proc/mounts "$folder/etc/mtab"
mountpoint -q "$folder/proc" || { mount -t proc proc "$folder/proc"; trap 'umount "$folder/proc"' EXIT; }
export DEBIAN_FRONTEND=noninteractive
# A mirror may stand still, and its lists be out of date.
apt=(chroot "$folder" apt-get -qq -o Acquire::Check-Valid-Until=false)
"${apt[@]}" update
"${apt[@]}" install -y --no-install-recommends ca-certificates blender python3-numpy python3-requests \
    python3-zstandard python3-cattr python3-pytest xvfb xauth libgl1-mesa-dri libegl1 imagemagick fonts-dejavu-core >>"$folder.log"
chroot "$folder" blender --version
touch "$folder/.ready"
