#!/usr/bin/env bash
# Installs the extra pica[cpu], Embree as the tracer of rays, where pica would run on the processor.
# Usage: setup_embree.sh [PYTHON], a Python that has pica
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}

# Exit code 1: a graphics card is there; 0: the processor does the work and Embree is not installed.
wants_embree() {
    "$python" - >/dev/null 2>&1 <<'PYTHON'
import sys
from pica.rhi import embree
from pica.rhi.adapters import choose, is_software

sys.exit(not (is_software(choose(None)) and embree.missing()))
PYTHON
}

wants_embree || exit 0
echo "pica: no graphics card; installing Embree, which traces rays on the processor"
"$python" -m pip install --quiet --disable-pip-version-check --only-binary :all: -r requirements-cpu.lock ||
    echo "pica: Embree cannot be installed here; rays go the slower way through Mesa's lavapipe"
