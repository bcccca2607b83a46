# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts/setup.sh: system packages, with apt-get (bash).
# Each is looked for by what it provides, so one that came another way (say, a GHDL built from source) is not installed
# again.

ghdl_works() { command -v ghdl >/dev/null && ghdl --version >/dev/null 2>&1; }

# The packages of the needs that are missing, one a line.
missing_packages() {
    local missing=()
    if needs ghdl; then
        # With LLVM's code generator for speed; any other back end that is there already will do.
        ghdl_works || missing+=(ghdl-llvm)
        command -v gcc >/dev/null || missing+=(gcc)
        [ -e /usr/include/zlib.h ] || missing+=(zlib1g-dev)
    fi
    if needs c++; then
        command -v g++ >/dev/null || missing+=(g++)
        command -v make >/dev/null || missing+=(make)
        perl -MPod::Usage -MGetopt::Long -MFindBin -e 1 2>/dev/null || missing+=(perl)
    fi
    if needs tcl; then
        command -v tclsh >/dev/null || missing+=(tcl)
    fi
    printf '%s\n' "${missing[@]}"
}

# Ubuntu's chromium is no apt package, and nothing but a test needs it: no browser is no failure.
browser_missing() {
    local seen
    needs browser || return 1
    for seen in chromium chromium-headless-shell chromium-browser google-chrome; do
        if command -v "$seen" >/dev/null; then return 1; fi
    done
    { [ -n "$retry" ] || [ ! -e "$cache/chromium.failed" ]; } && grep -qsx 'ID=debian' /etc/os-release
}
install_browser() { # the one without windows where there is such a package, which brings two thirds of the others
    local package=chromium
    become_root $package
    if [ -z "$lists_read" ]; then read_package_lists; fi
    if apt-cache show chromium-headless-shell >/dev/null 2>&1; then package=chromium-headless-shell; fi
    install_packages $package
}

# Sets $as_root to the command that runs another as root; ends the set-up where there is none.
become_root() { # packages for the message
    as_root=()
    if ! command -v apt-get >/dev/null; then
        die "missing: $* (names of Debian packages); this machine has no apt-get, install them by hand and run again"
    fi
    if [ "$(id -u)" != 0 ]; then
        if ! command -v sudo >/dev/null || ! sudo -n true 2>/dev/null; then
            die "some system packages are missing and this user may not install them. Please run" \
                "    sudo apt-get update && sudo apt-get install -y --no-install-recommends $*" \
                "and then the same make command again."
        fi
        as_root=(sudo -n)
    fi
}

apt() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 -o Acquire::Retries=2 \
        "$@" >>"$cache/apt.log" 2>&1 </dev/null 9>&-
}

read_package_lists() {
    : >"$cache/apt.log"
    apt update || say "apt-get update reported errors (see .cache/apt.log), going on with the package lists there are"
}

install_packages() {
    say "installing with apt-get: $*"
    if ! apt -y --no-install-recommends install "$@"; then
        tail -n 8 "$cache/apt.log" >&2
        die "could not install: $* (the whole output is in .cache/apt.log)." \
            "Try: apt-get install -y --no-install-recommends $*"
    fi
    hash -r
}
