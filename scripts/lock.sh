#!/usr/bin/env bash
# Writes requirements.lock and, for the extras, requirements-{cpu,denoise,docs,view,meshes,usd,test,ray}.lock from pyproject.toml.
# Usage: lock.sh PYTHON
set -euo pipefail
cd "$(dirname "$0")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$1" -m venv "$scratch/venv"
pip="$scratch/venv/bin/python -m pip --disable-pip-version-check"

# With the marker that pyproject.toml has for it.
packages() {
    $pip freeze --all --exclude pica --exclude pip | sed "s/^opengl[-_]basisu==.*/&; platform_machine != 'aarch64'/"
}

# Locks an extra, without what there was after another one. Usage: lock EXTRA OTHER
lock() {
    $pip install --quiet ".[$1]"
    packages >"$scratch/after-$1"
    { echo "# Made by make lock"; echo "-r requirements.lock"; grep -vxFf "$scratch/after-$2" "$scratch/after-$1"; } >"$scratch/$1"
}

# Setuptools too: the package itself is built without fetching anything more.
$pip install --quiet --upgrade setuptools .
{ echo "# Made by make lock"; packages; } >"$scratch/plain"
packages >"$scratch/after-plain"
lock cpu plain
lock denoise cpu
lock docs denoise
lock view docs
lock meshes view
lock usd meshes
# With what denoising, docs, the viewer and file formats need, which tests need too.
lock test cpu
# Ray shares packages with the viewer, so it is installed where that is not.
"$1" -m venv "$scratch/without-viewer"
pip="$scratch/without-viewer/bin/python -m pip --disable-pip-version-check"
$pip install --quiet -r "$scratch/plain"
lock ray plain
cp "$scratch/plain" requirements.lock
for extra in cpu denoise docs view meshes usd test ray; do
    cp "$scratch/$extra" "requirements-$extra.lock"
done
