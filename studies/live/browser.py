# SPDX-License-Identifier: BSD-3-Clause
"""A page in headless Chromium that goes on running: its DevTools protocol over Bokeh's own websocket client.

with Browser(url, folder) as page:
    page.until("document.title == 'Fluxproof'")
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path
from urllib.request import urlopen

from tornado.websocket import websocket_connect

BROWSERS = "chromium", "chromium-headless-shell", "chromium-browser", "google-chrome"
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
TEXT = """(() => { const walk = (root, out) => { for (const e of root.querySelectorAll('*')) {
  if (e.shadowRoot) walk(e.shadowRoot, out); else if (e.children.length == 0) out.push(e.textContent); } return out; };
  return document.body ? walk(document.body, []).join(" ") : ""; })()"""  # all that is written on the page
START_S, STEP_S = 60.0, 0.02
KEYS = {"Tab": 9, "Enter": 13, " ": 32, "ArrowUp": 38, "ArrowDown": 40}  # name: code of Windows, as the protocol asks


class Browser:
    """One page; downloads go to ``folder``."""

    def __init__(self, url: str, folder: Path, width: int = 1080, height: int = 720) -> None:
        if CHROMIUM is None:
            raise FileNotFoundError("chromium is not installed (Debian package chromium)")
        profile = folder / "profile"
        command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        command += [f"--window-size={width},{height}", f"--user-data-dir={profile}", "--remote-debugging-port=0"]
        self.process = subprocess.Popen(
            [*command, "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # one group with its renderers, which outlive it otherwise
        )
        self.loop, self.socket, self.count = asyncio.new_event_loop(), None, 0
        try:
            self._connect(profile / "DevToolsActivePort")
            self.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
            self.ask("Page.enable")
            self.ask("Page.navigate", url=url)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *error) -> None:
        self.close()

    def close(self) -> None:
        """End the browser."""
        if self.socket is not None:
            self.socket.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self.loop.close()

    def _connect(self, port_file: Path) -> None:
        """Wait for the browser, which writes its port to a file, and take its first page."""
        end, address = time.monotonic() + START_S, None
        while address is None:
            if time.monotonic() > end or self.process.poll() is not None:
                raise RuntimeError(f"{CHROMIUM} did not start within {START_S:.0f} s")
            time.sleep(STEP_S)
            lines = port_file.read_text().splitlines() if port_file.exists() else []
            if len(lines) < 2:
                continue
            with urlopen(f"http://127.0.0.1:{lines[0]}/json/list", timeout=START_S) as answer:
                pages = [p for p in json.load(answer) if p["type"] == "page"]
            address = pages[0]["webSocketDebuggerUrl"] if pages else None
        self.socket = self.loop.run_until_complete(_open(address))

    def ask(self, method: str, **parameters) -> dict:
        """One command of the protocol and its answer; RuntimeError with the browser's words."""
        self.count += 1
        answer = self.loop.run_until_complete(self._answer(self.count, {"method": method, "params": parameters}))
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    async def _answer(self, number: int, question: dict) -> dict:
        """The answer of this number; events that come before it are of no interest."""
        assert self.socket is not None
        await self.socket.write_message(json.dumps({"id": number, **question}))
        while True:
            text = await self.socket.read_message()
            if text is None:
                raise RuntimeError("the browser has closed the page")
            answer = json.loads(text)
            if answer.get("id") == number:
                return answer

    def js(self, expression: str):
        """The value of an expression in the page."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"].get("exception", {}).get("description", expression))
        return answer["result"].get("value")

    def until(self, expression: str, seconds: float = 30.0):
        """The first true value of an expression; TimeoutError where none comes."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if value := self.js(expression):
                return value
            time.sleep(STEP_S)
        raise TimeoutError(f"not true within {seconds:g} s: {expression}")

    def key(self, name: str) -> None:
        """Press a key and release it."""
        what = {"key": name, "code": {" ": "Space"}.get(name, name), "windowsVirtualKeyCode": KEYS[name]}
        text = {"text": name} if name == " " else {"text": "\r"} if name == "Enter" else {}
        self.ask("Input.dispatchKeyEvent", type="keyDown", **what, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **what)

    def names(self, *roles: str) -> list[tuple[str, str]]:
        """(role, name) of the accessibility tree, as a screen reader says them."""
        nodes = self.ask("Accessibility.getFullAXTree")["nodes"]
        found = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n["ignored"]]
        return [pair for pair in found if pair[0] in roles]

    def picture(self, path: Path) -> None:
        """Save what is seen as PNG."""
        data = self.ask("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))


async def _open(address: str):
    return await websocket_connect(address, max_message_size=1 << 26)
