# SPDX-License-Identifier: BSD-3-Clause
"""A page in headless Chromium.

The unchanged page is in a frame of 400 px with its own Content-Security-Policy; a script outside the frame inspects it
and writes the result into the dumped DOM.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape

import pytest

BROWSERS = "chromium", "chromium-headless-shell", "chromium-browser", "google-chrome"
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
ATTEMPTS = 3  # on a busy machine the virtual time may run out before a picture is decoded
PROBE = """<body style="margin:0"><pre id="seen"></pre><iframe id="f" style="border:0;width:%dpx;height:800px"></iframe>
<script>
const frame = document.getElementById("f"), say = v => document.getElementById("seen").textContent = JSON.stringify(v);
frame.onload = async () => {
  const doc = frame.contentDocument, all = s => [...doc.querySelectorAll(s)];
  const wide = async href => {
    const i = new Image(); i.src = href; await i.decode().catch(() => 0); return i.naturalWidth;
  };
  const href = e => e.getAttribute("src") || e.getAttribute("href") || e.getAttribute("xlink:href") || "";
  const rasters = all("img, image");
  say({
    first: doc.body.innerText.trim().split("\\n")[0],
    overflow: doc.documentElement.scrollWidth - doc.documentElement.clientWidth,
    width: doc.documentElement.clientWidth,
    cut: all("p, td, th, code, h1, h2, h3, svg").filter(e => e.getBoundingClientRect().right > %d).length,
    pictures: all("figure svg").map(e => Math.min(e.getBoundingClientRect().width, e.getBoundingClientRect().height)),
    rasters: await Promise.all(rasters.map(e => wide(href(e)))),
    links: all("[src], [href], [*|href]").map(href).filter(h => !/^(data:image.png|#)/.test(h)),
    fetched: frame.contentWindow.performance.getEntriesByType("resource").map(e => e.name)
      .filter(name => !name.startsWith("data:")),
    scripts: all("script").length, title: doc.title, ink: getComputedStyle(doc.body).color,
  });
};
frame.srcdoc = %s;
</script>"""


def seen(html: str, folder, *flags: str, width: int = 400) -> tuple[dict, str]:
    """(what the probe saw of the page in a frame of that width, what the browser logged)."""
    if CHROMIUM is None:
        pytest.skip("chromium is not installed (Debian package chromium)")
    page = folder / "probe.html"
    page.write_text(PROBE % (width, width, json.dumps(html).replace("</", "<\\/")), encoding="utf-8")
    browser = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *flags]
    browser += [
        f"--user-data-dir={folder / 'profile'}",
        "--enable-logging=stderr",
        "--virtual-time-budget=20000",
    ]
    for _ in range(ATTEMPTS):
        done = subprocess.run(
            [*browser, "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=120, encoding="utf-8"
        )
        if found := re.search(r'<pre id="seen">(.+?)</pre>', done.stdout, re.DOTALL):
            break
    assert found, done.stderr[-2000:]
    return json.loads(unescape(found[1])), "\n".join(s for s in done.stderr.splitlines() if "CONSOLE" in s)
