#!/usr/bin/env bash
# Installs the extra pica[cpu], Embree as the tracer of rays, where pica would run on the processor.
# Usage: setup_embree.sh [PYTHON], a Python that has pica
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}

# "yes" where the processor does the work and Embree is not installed. A fault in here stops the set-up: were it taken
# for a "no", everything would go on without Embree and nobody would know.
wants_embree=$("$python" - <<'PYTHON'
from pica.rhi.adapters import choose, is_software
from pica.tracing import embree

print("yes" if is_software(choose(None)) and embree.missing() else "no")
PYTHON
)

[ "$wants_embree" = yes ] || exit 0
echo "pica: no graphics card; installing Embree, which traces rays on the processor"
"$python" -m pip install --quiet --disable-pip-version-check --only-binary :all: -r requirements-cpu.lock ||
    echo "pica: Embree cannot be installed here; rays go the slower way through Mesa's lavapipe"
