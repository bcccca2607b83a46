# SPDX-License-Identifier: BSD-3-Clause
"""What the set-up must not do: delete what an installation running beside it has fetched."""

import os
import shutil
import subprocess

import pytest

from fluxproof.checkout import ROOT

HOOK = 'APT::Update::Post-Invoke { "rm -f /var/cache/apt/archives/*.deb"; };\n'


def hooks(tmp_path, *options) -> list[str]:
    """What `apt-get update` with these options would run, on a machine whose configuration has HOOK."""
    planted = tmp_path / "image.conf"
    planted.write_text(HOOK)
    text = subprocess.run(
        ["apt-config", *options, "dump"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"APT_CONFIG": str(planted)},
    ).stdout
    return [line for line in text.splitlines() if line.startswith("APT::Update::Post-Invoke") and "rm " in line]


@pytest.mark.skipif(shutil.which("apt-config") is None, reason="this machine has no apt")
def test_the_private_update_runs_no_hook_of_the_machine(tmp_path):
    conf = ROOT / "scripts/setup/no_hooks.conf"
    assert hooks(tmp_path), "the hook was not planted"
    assert not hooks(tmp_path, "-c", str(conf))
    assert str(conf.relative_to(ROOT)) in (ROOT / "scripts/setup/ghdl5.sh").read_text()
