#!/usr/bin/env bash
# Makes sure that Mitsuba, which the reference tests compare with, finds an LLVM that it can use: 19. Older ones
# that a system may have, lavapipe's among them, abort on some processors.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/apt.sh
again="sh -c 'apt-get update && apt-get install -y libllvm19'"

compgen -G '/usr/lib/*/libLLVM.so.19*' >/dev/null && exit 0
if ! command -v apt-get >/dev/null; then
    echo "pica: no LLVM 19 at /usr/lib/*/libLLVM.so.19*; the tests that compare with Mitsuba need it"
    exit 0
fi
echo "pica: installing LLVM 19 for the tests that compare with Mitsuba"
apt_get update
apt_get install -y --no-install-recommends libllvm19
