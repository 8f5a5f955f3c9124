"""A headless Chromium driven through a pipe by the Chrome DevTools Protocol."""

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

SOFTWARE_GL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def find_chromium() -> str | None:
    return next((path for path in map(shutil.which, NAMES) if path), None)


needs_chromium = pytest.mark.skipif(
    find_chromium() is None, reason="Chromium is not installed: no page is looked at"
)


class Chromium:
    """One page.

    `complaints` gathers errors and warnings of the console, uncaught exceptions, and requests.
    Messages are JSON, each ended by NUL.
    """

    def __init__(self, profile: Path, gl: bool = True):
        flags = SOFTWARE_GL if gl else ("--disable-gpu", "--disable-3d-apis")
        to_browser, write = os.pipe()
        read, from_browser = os.pipe()
        # The browser reads from descriptor 3 and writes to 4.
        redirected = f'exec "$@" 3<&{to_browser} 4>&{from_browser}'
        self._process = subprocess.Popen(
            ["bash", "-c", redirected, "bash", find_chromium(), "--headless=new", "--no-sandbox",
             "--remote-debugging-pipe", "--disable-dev-shm-usage", "--hide-scrollbars",
             "--no-first-run", f"--user-data-dir={profile}", *flags, "about:blank"],
            pass_fds=(to_browser, from_browser), stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, start_new_session=True,
        )
        os.close(to_browser)
        os.close(from_browser)
        self._write, self._read, self._buffer = write, read, b""
        self._id, self._session = 0, None
        self.complaints = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")

    def send(self, method: str, timeout: float = 60.0, **parameters) -> dict:
        """Return the result of a command; events that arrive meanwhile are looked at."""
        self._id += 1
        message = {"id": self._id, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + timeout
        while True:
            answer = self._receive(until, method)
            if answer.get("id") == self._id:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._note(answer)

    def open(self, path: Path) -> None:
        """Load a page, go to each of its players and wait until it is ready or has said why not."""
        self.complaints.clear()
        self.send("Page.navigate", url=path.resolve().as_uri())
        until = time.monotonic() + 60
        while self.evaluate("document.readyState") != "complete" or not self.evaluate(
            "location.protocol == 'file:'"
        ):
            assert time.monotonic() < until, "the page does not load"
            time.sleep(0.05)
        self.evaluate("(async () => { for (const root of document.querySelectorAll('.replay')) {"
                      " root.scrollIntoView({ behavior: 'instant' }); await root.player.ready"
                      ".catch(() => 0); } scrollTo({ top: 0, behavior: 'instant' }); })()")

    def evaluate(self, expression: str):
        """Return the value of an expression in the page; a promise is waited for."""
        answer = self.send("Runtime.evaluate", expression=expression, awaitPromise=True,
                           returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def resize(self, width: int, height: int, mobile: bool = False) -> None:
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=mobile)
        self.settle()

    def use_scheme(self, scheme: str) -> None:
        """Prefer a light or a dark page."""
        self.send("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.settle()

    def settle(self) -> None:
        """Wait until the page has drawn what it was asked to draw."""
        self.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame("
                      "() => setTimeout(done, 30))))")

    def press(self, key: str, code: str | None = None) -> None:
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=code or key,
                      **(text if kind == "keyDown" else {}))

    def screenshot(self) -> bytes:
        """Return the page as a PNG file."""
        self.settle()
        return base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        for end in (self._write, self._read):
            os.close(end)
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    def _receive(self, until: float, waiting_for: str) -> dict:
        while b"\0" not in self._buffer:
            left = until - time.monotonic()
            ready = left > 0 and select.select([self._read], [], [], left)[0]
            assert ready, f"Chromium does not answer {waiting_for}"
            part = os.read(self._read, 1 << 20)
            assert part, "Chromium has ended"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict) -> None:
        method, told = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(each.get("value")) for each in told["args"]))
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(str(told["exceptionDetails"]))
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.complaints.append(told["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            url = told["request"]["url"]
            if not url.startswith(("file:", "data:", "blob:", "about:")):
                self.complaints.append(f"request: {url}")
