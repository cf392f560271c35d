# Sourced by the set-up scripts: Debian packages with whatever rights there are.

fail() {
    echo "pica: $*" >&2
    exit 1
}

# Runs a command as root; without the rights, prints the command that the caller names in $again and exits.
as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo -n "$@"
    else
        fail "this needs root. Run: sudo $again"
    fi
}

# Quiet but for errors.
apt_get() {
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@" >/dev/null
}
