#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Set up what a target of the Makefile uses, on Debian 12 or Ubuntu 22.04 and newer (scripts/setup/needs.sh lists it):
#   - system packages, with apt-get (only the missing ones; needs root or sudo without a password)
#   - .venv with the exact Python packages of requirements.lock that belong to the target's groups
#   - on Debian also chromium, if it can be had: one test opens the report in it, and is skipped without
#   - .cache/ghdl5, the GHDL 5 used to convert the VHDL to Verilog
#   - .cache/yowasp, Yosys and nextpnr compiled for this machine
# A second run only compares hashes.  Interrupted, it starts the unfinished part again.
#
# usage:       setup.sh [--retry] [TARGET ...]     without a target: everything
# environment: PYTHON=/path/to/python3  build .venv with this interpreter
# option:      --retry                  try again to get GHDL 5 and chromium after a failure
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
cache=$root/.cache
venv=$root/.venv
stamp=$venv/.fluxproof-stamp
export YOWASP_CACHE_DIR=${YOWASP_CACHE_DIR:-$cache/yowasp}
# Not the interpreter of the environment that is about to be replaced.
PATH=:$PATH:
PATH=${PATH//":$venv/bin:"/:}  # an activated .venv is there twice; the next one is not built with it
PATH=${PATH//":$venv/bin:"/:}
PATH=${PATH#:} PATH=${PATH%:}
unset VIRTUAL_ENV PYTHONHOME PYTHONPATH

say() { printf 'setup: %s\n' "$*" >&2; }
die() { printf 'setup: %s\n' "$@" >&2; exit 1; }
hash_of() { cat -- "$@" | sha256sum | cut -c1-32; }
stamp_is() { local have=; [ -r "$1" ] && read -r have <"$1" && [ "$have" = "$2" ]; }

for part in needs packages venv tools; do
    # shellcheck source=/dev/null
    . "scripts/setup/$part.sh"
done

retry=
needed=()
if [ "${1:-}" = --retry ]; then retry=1; shift; fi
for target in "${@:-setup}"; do
    words=$(needs_of "$target") || die "no such target: $target"
    # shellcheck disable=SC2206
    needed+=($words)
done
needs() { [[ " ${needed[*]} " == *" $1 "* ]]; }

lock_key=$(hash_of requirements.lock)
venv_key=$({ printf '%s\n' "$root"; cat requirements.lock requirements/*.txt scripts/setup/venv.sh; } | sha256sum | cut -c1-32)
ghdl5_key=$(hash_of scripts/setup/ghdl5.sh)

# ---------------------------------------------------------------- fast path
ghdl5_settled() { ! needs ghdl5 || have_ghdl5 || gave_up_ghdl5; }
if [ -z "$(missing_packages)$(missing_groups)$(uncompiled)" ] && ! browser_missing && ghdl5_settled; then
    if needs ghdl5 && ! have_ghdl5; then no_ghdl5; fi
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

mapfile -t groups < <(missing_groups)
mapfile -t missing < <(missing_packages | sed '/^$/d')
say "getting ready what is missing, minutes the first time: ${missing[*]} ${groups[*]}$(needs ghdl5 && ! have_ghdl5 && echo ' GHDL 5')$(printf ' %s' $(uncompiled))"

# Everything below that can be done beside something else is: processes of the background, waited for at the end.
background=()
beside() { "$@" & background+=($!); }

python_missing() { [ "${#groups[@]}" -gt 0 ] && ! venv_is_current && ! find_python; }
lists_read=
if [ "${#missing[@]}" -gt 0 ] || python_missing; then
    become_root "${missing[@]}" $(if python_missing; then python_packages 2>/dev/null; fi)
    read_package_lists
    lists_read=1
fi
ghdl5_waits=
if needs ghdl5 && ! have_ghdl5; then
    if ghdl5_is_coming "${missing[@]}"; then ghdl5_waits=1; else beside make_ghdl5; fi
fi
if python_missing; then
    mapfile -t packages < <(python_packages)
    if [ "${#packages[@]}" -gt 0 ]; then install_packages "${packages[@]}"; fi
fi
python_part() {
    local tool
    if [ "${#groups[@]}" -gt 0 ]; then make_venv "${groups[@]}"; fi
    for tool in $(uncompiled); do compile_tool "$tool"; done
}
beside python_part

if [ "${#missing[@]}" -gt 0 ]; then
    install_packages "${missing[@]}"
    still=$(missing_packages)
    [ -z "$still" ] || die "apt-get went through, but this is still not usable: $(echo $still)"
fi
if [ -n "$ghdl5_waits" ]; then beside make_ghdl5; fi
if needs ghdl; then
    case "$(ghdl --version | sed -n '1s/^GHDL \([^ ]*\).*/\1/p')" in
        0.* | 1.*) say "NOTE: the simulations were tried with GHDL 2.0 and 5.0, this older one may not do" ;;
    esac
fi
if browser_missing && ! (install_browser); then # in a shell of its own, as a failure ends the shell
    touch "$cache/chromium.failed"
    say "NOTE: chromium is not available; the test that opens the report in a browser is skipped." \
        "('make setup' tries again)"
fi

failed=
for job in "${background[@]}"; do wait "$job" || failed=1; done
[ -z "$failed" ] || exit 1 # the job has said why
