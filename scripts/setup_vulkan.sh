#!/usr/bin/env bash
# Makes sure that there is a Vulkan device with ray tracing pipelines: where none is found, installs the Vulkan loader
# and Mesa's lavapipe, which runs on the processor. Usage: setup_vulkan.sh [PYTHON], a Python that has SlangPy
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/apt.sh
python=${1:-.venv/bin/python}
again="bash $PWD/scripts/setup_vulkan.sh $python"
needed=24.3 # the first Mesa whose lavapipe has ray tracing pipelines

# In a process of its own: a broken driver may crash it.
has_ray_tracing() {
    "$python" - >/dev/null 2>&1 <<'PYTHON'
import sys
import slangpy as spy

kind = spy.DeviceType.vulkan
devices = (spy.Device(type=kind, adapter_luid=adapter.luid) for adapter in spy.Device.enumerate_adapters(kind))
sys.exit(not any(device.has_feature(spy.Feature.ray_tracing) for device in devices))
PYTHON
}

mesa_is_new_enough() {
    candidate=$(LC_ALL=C apt-cache "$@" policy mesa-vulkan-drivers | awk '/Candidate:/ { print $2 }')
    dpkg --compare-versions "${candidate:-0}" ge "$needed"
}

has_ray_tracing && exit 0
command -v apt-get >/dev/null ||
    fail "no Vulkan device with ray tracing pipelines found. Install libatomic, libX11, the Vulkan loader and Mesa >= $needed" \
        "with its lavapipe driver (Fedora: mesa-vulkan-drivers, Arch: vulkan-swrast)"

# What SlangPy's own libraries load; with a graphics card's driver there already, that is all that is missing.
echo "pica: no Vulkan device with ray tracing pipelines found; installing the Vulkan loader"
apt_get update
apt_get install -y --no-install-recommends libatomic1 libx11-6 libvulkan1
reason=$("$python" -c 'import slangpy' 2>&1 | tail -1)
[ -z "$reason" ] || fail "SlangPy does not load in $python: $reason"
has_ray_tracing && exit 0

echo "pica: still none; installing Mesa's lavapipe, which runs on the processor"
options=()
if ! mesa_is_new_enough; then
    # Debian 12's own Mesa is too old. Its backports are asked for at the mirror that the rest of the system comes from,
    # through a folder of sources that exists only for this run.
    release=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
    format='$(ORIGIN)|$(LABEL)|$(COMPONENT)|$(CODENAME)|$(REPO_URI)'
    mirror=$(apt-get indextargets --format "$format" 'Created-By: Packages' |
        awk -F'|' -v release="$release" '$1 == "Debian" && $2 == "Debian" && $3 == "main" && $4 == release { print $5; exit }')
    [ -n "$mirror" ] || fail "the distribution's Mesa ($candidate) is older than $needed; install a newer mesa-vulkan-drivers"
    sources=$(mktemp -d)
    trap 'rm -rf "$sources"' EXIT
    keys=/usr/share/keyrings/debian-archive-keyring.gpg
    mkdir "$sources/backports" "$sources/all"
    echo "deb [$([ ! -e $keys ] || echo "signed-by=$keys")] $mirror $release-backports main" |
        sed 's/ \[\]//' >"$sources/backports/pica.list"
    cp "$sources/backports/pica.list" "$sources/all/pica-backports.list"
    find /etc/apt/sources.list.d -maxdepth 1 \( -name '*.list' -o -name '*.sources' \) -exec cp {} "$sources/all" \;
    echo "pica: Mesa $candidate is too old, taking it from $release-backports"
    apt_get update -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$sources/backports" \
        -o APT::Get::List-Cleanup=false
    options=(-o Dir::Etc::sourceparts="$sources/all" -t "$release-backports")
    mesa_is_new_enough "${options[@]}" || fail "no Mesa >= $needed in $release-backports; install a newer mesa-vulkan-drivers"
fi
apt_get install -y --no-install-recommends "${options[@]}" mesa-vulkan-drivers

has_ray_tracing || fail "lavapipe is installed, but offers no ray tracing pipelines; run: .venv/bin/pica doctor"
echo "pica: lavapipe $(dpkg-query -W -f '${Version}' mesa-vulkan-drivers) is ready"
