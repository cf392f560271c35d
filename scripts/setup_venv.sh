#!/usr/bin/env bash
# Makes an empty virtual environment. Usage: setup_venv.sh PYTHON FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/apt.sh
python=$1 folder=$2

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "$python is missing or older than 3.11. Name a newer one: make PYTHON=python3.12"

# Debian keeps the part of Python that makes virtual environments in a package of its own.
if ! "$python" -c 'import ensurepip' 2>/dev/null; then
    command -v apt-get >/dev/null || fail "$python cannot make virtual environments (no ensurepip); install its venv module"
    echo "pica: installing python3-venv"
    again="sh -c 'apt-get update && apt-get install -y python3-venv'"
    apt_get update
    apt_get install -y --no-install-recommends python3-venv
fi
"$python" -m venv "$folder"
