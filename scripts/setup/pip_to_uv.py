# SPDX-License-Identifier: BSD-3-Clause
"""Prints pip's settings as uv's environment, in `export` lines for a shell: uv does not read pip.conf.

What is set for uv already is left alone.  Exit status 1 where a setting has no counterpart: then pip must install.
"""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys

# pip's option: uv's variable, what separates several values there
VARIABLES = {
    "index-url": ("UV_DEFAULT_INDEX", " "),
    "extra-index-url": ("UV_INDEX", " "),
    "find-links": ("UV_FIND_LINKS", ","),
    "trusted-host": ("UV_INSECURE_HOST", " "),
    "timeout": ("UV_HTTP_TIMEOUT", " "),
    "default-timeout": ("UV_HTTP_TIMEOUT", " "),
    "cert": ("SSL_CERT_FILE", " "),
    "proxy": ("ALL_PROXY", " "),
}
UNKNOWN = {"no-index", "client-cert"}
ORDER = ["global", "install", ":env:"]  # the later one counts


def settings() -> dict[str, str]:
    """{option: value} of `pip config list`, whose lines read section.option='value'."""
    text = subprocess.run(
        [sys.executable, "-m", "pip", "config", "list"], capture_output=True, text=True, check=True
    ).stdout
    found = [match.groups() for match in re.finditer(r"^(\S+?)\.(\S+?)=(.*)$", text, re.MULTILINE)]
    found = [entry for entry in found if entry[0] in ORDER]
    found.sort(key=lambda entry: ORDER.index(entry[0]))
    return {option: ast.literal_eval(value) for _, option, value in found}


def main() -> int:
    given = settings()
    if UNKNOWN & given.keys():
        print(f"uv has no counterpart of pip's {', '.join(sorted(UNKNOWN & given.keys()))}", file=sys.stderr)
        return 1
    for option, (variable, separator) in VARIABLES.items():
        if option in given and variable not in os.environ:
            print(f"export {variable}={shlex.quote(separator.join(given[option].split()))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
