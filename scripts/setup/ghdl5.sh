#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Provide GHDL 5 as .cache/ghdl5/bin/ghdl, for the VHDL -> Verilog conversion.
#
# GHDL 2 miscompiles in silence when it writes Verilog (a signed shift_right
# comes out as a logical shift), so its output must never be used.  When the
# machine's own ghdl is older than 5, the packages of a later release of the
# same distribution are fetched with apt (signatures checked as always), unpacked
# into .cache/ghdl5 and started through their own loader: nothing is installed,
# the machine's libraries stay as they are, and no root is needed.
#
# usage: ghdl5.sh ROOT     (exit 0: ready and self-checked; 1: not available)
set -euo pipefail

root=$(cd "$1" && pwd)
cache=$root/.cache
dest=$cache/ghdl5
new=$cache/ghdl5.new
apt_dir=$cache/ghdl5.apt
log=$cache/ghdl5.log

say() { printf 'setup: ghdl5: %s\n' "$*" >&2; }
fail() { say "$*"; rm -rf "$new" "$apt_dir"; exit 1; }

ghdl_major() { "$1" --version 2>/dev/null | sed -n '1s/^GHDL \([0-9][0-9]*\).*/\1/p'; }

# Convert a signed shift_right and insist on an arithmetic shift in the Verilog.
self_check() {
    local ghdl=$1 dir ok=1
    dir=$(mktemp -d "$cache/ghdl5.check.XXXXXX")
    cat >"$dir/sc.vhd" <<'VHDL'
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity sc is port (a : in signed(7 downto 0); y : out signed(7 downto 0)); end;
architecture r of sc is begin
  y <= shift_right(a, 3);
end;
VHDL
    if (cd "$dir" && "$ghdl" --synth --std=08 --out=verilog sc.vhd -e sc >sc.v 2>sc.err) &&
        grep -q '>>>' "$dir/sc.v"; then ok=0; fi
    [ $ok = 0 ] || { cat "$dir/sc.err" "$dir/sc.v" >>"$log" 2>/dev/null || true; }
    rm -rf "$dir"
    return $ok
}

install_new() { # the finished $new becomes $dest
    rm -rf "$cache/ghdl5.old"
    if [ -e "$dest" ]; then mv "$dest" "$cache/ghdl5.old"; fi
    mv "$new" "$dest"
    rm -rf "$cache/ghdl5.old" "$apt_dir"
}

mkdir -p "$cache"
rm -rf "$new" "$apt_dir" "$cache"/ghdl5.check.*
mkdir -p "$new/bin"
: >"$log"

# 1. The machine's own ghdl, when it is new enough.
for name in ghdl ghdl-mcode ghdl-llvm; do
    own=$(command -v "$name" || true)
    [ -n "$own" ] || continue
    major=$(ghdl_major "$own")
    if [ "${major:-0}" -ge 5 ]; then
        printf '#!/bin/sh\nexec %q "$@"\n' "$own" >"$new/bin/ghdl"
        chmod +x "$new/bin/ghdl"
        if self_check "$new/bin/ghdl"; then
            install_new
            say "using the installed $own (version $major)"
            exit 0
        fi
        say "the installed $own converts a signed shift wrongly or cannot write Verilog"
    fi
done

# 2. The packages of a later release.
for tool in apt-get dpkg; do
    command -v $tool >/dev/null || fail "this machine has no $tool: install GHDL 5 or newer as 'ghdl' yourself"
done
. /etc/os-release
case "${ID:-}:${VERSION_CODENAME:-}" in
    debian:*) releases="trixie forky" ;;
    ubuntu:*) releases="resolute questing plucky" ;;
    *) fail "unknown distribution '${ID:-?}': install GHDL 5 or newer as 'ghdl' yourself" ;;
esac
component=main
[ "$ID" = debian ] || component=universe
case "$(dpkg --print-architecture)" in
    amd64 | i386) ;;
    *) fail "the mcode code generator exists for x86 only: install GHDL 5 or newer as 'ghdl' yourself" ;;
esac

# The distribution's own archive among the configured sources: its release is
# exactly this one (not -security, not a third party's) and its origin, where the
# package lists have been read, is the distribution.  apt itself reads both source formats.
# Where the package lists were never read, apt tells no origin: then the address must say it.
archive=
for option in --release-info --no-release-info; do
    [ -z "$archive" ] || break
    archive=$(apt-get indextargets $option --format '$(REPO_URI)|$(RELEASE)|$(COMPONENT)|$(ORIGIN)' 'Created-By: Packages' 2>>"$log" |
        awk -F'|' -v rel="$VERSION_CODENAME" -v id="$ID" '
            ($2 == rel || $2 ~ /^(old)*stable$/) && $3 == "main" && uri == "" {
                origin = tolower($4)
                if (origin ~ /^\$/) origin = ""
                if (origin == id || (origin == "" && $1 ~ "/" id "(-ports)?/?$")) uri = $1
            }
            END { print uri }')
done
[ -n "$archive" ] || fail "found no entry of the $ID archive for '$VERSION_CODENAME' among apt's sources"
uri=$archive
keyring=/usr/share/keyrings/$ID-archive-keyring.gpg
signed_by=
if [ -r "$keyring" ]; then signed_by=$keyring; fi

mkdir -p "$apt_dir"/{state/lists/partial,cache/archives/partial,sources,none,debs}
apt_opts=(
    -c "$root/scripts/setup/no_hooks.conf"
    -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$apt_dir/sources"
    -o Dir::Etc::preferences=/dev/null -o Dir::Etc::preferencesparts="$apt_dir/none"
    -o Dir::State="$apt_dir/state" -o Dir::State::lists="$apt_dir/state/lists"
    -o Dir::Cache="$apt_dir/cache" -o Dir::Cache::archives="$apt_dir/cache/archives"
    -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache=
    -o Acquire::Languages=none -o Acquire::Retries=2 -o APT::Default-Release=
    -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false
    -o Acquire::IndexTargets::deb::Contents-deb::DefaultEnabled=false
)
if [ "$(id -u)" = 0 ]; then apt_opts+=(-o APT::Sandbox::User=root); fi

wanted=(ghdl-mcode ghdl-common libc6 libgcc-s1 zlib1g)
got=
for release in $releases; do
    [ "$release" != "$VERSION_CODENAME" ] || continue
    rm -rf "$apt_dir"/sources/* "$apt_dir"/state/lists/* "$apt_dir"/debs/*
    mkdir -p "$apt_dir/state/lists/partial"
    {
        printf 'Types: deb\nURIs: %s\nSuites: %s\nComponents: main' "$uri" "$release"
        if [ "$component" != main ]; then printf ' %s' "$component"; fi
        printf '\n'
        if [ -n "$signed_by" ]; then printf 'Signed-By: %s\n' "$signed_by"; fi
    } >"$apt_dir/sources/next.sources"
    say "reading the package lists of $ID $release"
    if ! apt-get "${apt_opts[@]}" -qq update >>"$log" 2>&1; then continue; fi
    if ! (cd "$apt_dir/debs" && apt-get "${apt_opts[@]}" -qq download "${wanted[@]}" >>"$log" 2>&1); then continue; fi
    for deb in "$apt_dir"/debs/ghdl-mcode_[5-9]*.deb "$apt_dir"/debs/ghdl-mcode_[1-9][0-9]*.deb; do
        if [ -e "$deb" ]; then got=$release; fi
    done
    if [ -n "$got" ]; then break; fi
done
if [ -z "$got" ]; then
    sed 's/^/    /' "$log" | tail -n 5 >&2 || true
    fail "no later release of $ID could be read (tried: $releases)"
fi

for deb in "$apt_dir"/debs/*.deb; do dpkg -x "$deb" "$new"; done
rm -rf "$new/etc" "$new/usr/share/doc" "$new/usr/share/man" "$new/usr/share/locale" "$new/usr/share/lintian" \
    "$new"/usr/lib/*/gconv

inside() { (cd "$new" && find . "$@" -print -quit | sed 's|^\./||'); }
std=$(inside -path '*/std/v08/std-obj08.cf')
libc=$(inside -name 'libc.so.6')
loader=$(inside -type f -name 'ld-linux*.so.*')
binary=usr/bin/ghdl-mcode
[ -n "$std" ] && [ -n "$loader" ] && [ -n "$libc" ] && [ -x "$new/$binary" ] || fail "the packages of $got lack an expected file"
prefix=$(dirname "$(dirname "$(dirname "$std")")")
cat >"$new/bin/ghdl" <<WRAPPER
#!/bin/sh
# GHDL 5 from $ID $got, started through its own loader and libraries.
here=\$(cd "\$(dirname "\$(readlink -f "\$0")")/.." && pwd)
GHDL_PREFIX=\$here/$prefix
export GHDL_PREFIX
exec "\$here/$loader" --library-path "\$here/$(dirname "$libc")" "\$here/$binary" "\$@"
WRAPPER
chmod +x "$new/bin/ghdl"

major=$(ghdl_major "$new/bin/ghdl" || true)
[ "${major:-0}" -ge 5 ] || fail "the unpacked ghdl does not run or is too old (version '${major:-?}'), see .cache/ghdl5.log"
self_check "$new/bin/ghdl" || fail "self-check failed: a signed shift_right is not converted to '>>>', see .cache/ghdl5.log"
install_new
say "version $("$dest/bin/ghdl" --version | sed -n '1s/^GHDL \([^ ]*\).*/\1/p') of $ID $got is ready (self-check passed)"
