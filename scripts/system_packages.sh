#!/usr/bin/env bash
# Installs the system libraries that `import bpy` and its renderer need, and Python's venv, where they are missing; says so where
# the Python is another than the modules are built for.
set -euo pipefail

python=${1:-python3}
declare -A package=(
    [libX11.so.6]=libx11-6 [libXrender.so.1]=libxrender1 [libXfixes.so.3]=libxfixes3 [libXi.so.6]=libxi6
    [libXxf86vm.so.1]=libxxf86vm1 [libxkbcommon.so.0]=libxkbcommon0 [libSM.so.6]=libsm6 [libICE.so.6]=libice6
    [libGL.so.1]=libgl1 [libEGL.so.1]=libegl1 [libgomp.so.1]=libgomp1
)

[[ $(uname -s) == Linux ]] || exit 0
libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
missing=()
for library in "${!package[@]}"; do
    grep -qF "$library " <<<"$libraries" || missing+=("${package[$library]}")
done
command -v "$python" >/dev/null || missing+=(python3 python3-venv)
"$python" -c "import ensurepip, venv" 2>/dev/null || missing+=(python3-venv)

if ((${#missing[@]})); then
    if [[ $(id -u) != 0 ]] || ! command -v apt-get >/dev/null; then
        echo "Missing system packages; install them as root: apt-get install ${missing[*]}" >&2
        exit 1
    fi
    export DEBIAN_FRONTEND=noninteractive
    echo "Installing ${missing[*]}"
    apt-get update -qq
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

version=$("$python" -c "import platform; print(platform.python_version())")
if [[ $version != 3.11.* ]]; then
    echo "'$python' is Python $version, and Blender's modules need 3.11: install it, or say make PYTHON=path/to/python3.11" >&2
    exit 1
fi
