#!/usr/bin/env bash
# Writes requirements.lock and, for the extras, requirements-{cpu,denoise,test}.lock from pyproject.toml.
# Usage: lock.sh PYTHON
set -euo pipefail
cd "$(dirname "$0")/.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$1" -m venv "$scratch/venv"
pip="$scratch/venv/bin/python -m pip --disable-pip-version-check"

packages() {
    $pip freeze --all --exclude pica --exclude pip
}

# Setuptools too: the package itself is built without fetching anything more.
$pip install --quiet --upgrade setuptools .
{ echo "# Made by make lock"; packages; } >"$scratch/plain"
packages >"$scratch/run"
for extra in cpu denoise test; do
    $pip install --quiet ".[$extra]"
    { echo "# Made by make lock"; echo "-r requirements.lock"; packages | grep -vxFf "$scratch/run"; } >"$scratch/$extra"
    # What denoising needs is among what tests need, which are to run everywhere.
    [ "$extra" = denoise ] || packages >"$scratch/run"
done
cp "$scratch/plain" requirements.lock
cp "$scratch/cpu" requirements-cpu.lock
cp "$scratch/denoise" requirements-denoise.lock
cp "$scratch/test" requirements-test.lock
