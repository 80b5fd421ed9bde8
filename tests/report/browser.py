"""Headless Chromium for tests of reports: opens a file as a person would see it and says what went wrong.

Speaks the DevTools protocol over a pipe, so it needs no driver and no further package.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

_FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions",
    "--disable-default-apps", "--disable-dev-shm-usage", "--no-proxy-server", "--remote-debugging-pipe",
)  # fmt: skip
_TIMEOUT_S = 60.0

# Elements that stick out of the screen, unless something around them scrolls or clips by itself.
_OVERFLOWING = """(() => {
  const width = document.documentElement.clientWidth, found = [];
  const whole = document.documentElement.scrollWidth;
  if (whole > width) found.push('page ' + whole);
  for (const e of document.body.querySelectorAll('*')) {
    const box = e.getBoundingClientRect();
    if (box.width === 0 || (box.right <= width + 0.5 && box.left >= -0.5)) continue;
    let around = e.parentElement, held = false;
    for (; around; around = around.parentElement) {
      const o = getComputedStyle(around).overflowX;
      if (around !== document.body && around !== document.documentElement && o !== 'visible') held = true;
    }
    if (!held) found.push(e.tagName + '.' + (e.getAttribute('class') || '') + ' ' + e.textContent.slice(0, 40)
      + ' ' + Math.round(box.left) + '..' + Math.round(box.right));
  }
  return found;
})()"""

# Texts of shown figures that leave their drawing or lie on one another.
_COLLIDING = """(() => {
  const found = [];
  for (const svg of document.querySelectorAll('svg.plot')) {
    const frame = svg.getBoundingClientRect();
    if (frame.width === 0) continue;
    const texts = [...svg.querySelectorAll('text')].filter(t => t.textContent);
    const boxes = texts.map(t => t.getBoundingClientRect());
    const name = svg.querySelector('title').textContent;
    boxes.forEach((a, i) => {
      if (a.left < frame.left - 1 || a.right > frame.right + 1
          || a.top < frame.top - 1 || a.bottom > frame.bottom + 1)
        found.push(name + ': outside: ' + texts[i].textContent);
      if (texts[i].getAttribute('transform')) return;
      for (let j = i + 1; j < boxes.length; j++) {
        const b = boxes[j];
        if (texts[j].getAttribute('transform')) continue;
        const dx = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const dy = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (dx > 1 && dy > 4)
          found.push(name + ': touching: ' + texts[i].textContent + ' | ' + texts[j].textContent);
      }
    });
  }
  return found;
})()"""


class BrowserMissingError(RuntimeError):
    """No Chromium on this machine: reports cannot be shown to work, so tests fail."""


def find_chromium() -> str:
    """The browser's program. Raises BrowserMissingError, which no test may turn into a skip."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    raise BrowserMissingError("no Chromium found; the mend: apt-get install chromium")


@dataclass
class View:
    """An opened page at one screen size and theme."""

    browser: Browser
    session: str
    errors: list[str] = field(default_factory=list)
    """Console errors, exceptions, and refusals by the page's own policy."""
    requests: list[str] = field(default_factory=list)
    """Everything that the page asked for besides itself."""

    def evaluate(self, expression: str) -> Any:
        """The value of a script's expression in the page."""
        answer = self.browser.call(
            "Runtime.evaluate", self.session, expression=expression, returnByValue=True
        )
        if "exceptionDetails" in answer:
            raise AssertionError(answer["exceptionDetails"])
        return answer["result"].get("value")

    def overflowing(self) -> list[str]:
        """Elements that stick out sideways, in words; empty when all fits."""
        return list(self.evaluate(_OVERFLOWING))

    def colliding_texts(self) -> list[str]:
        """Texts in figures that leave the drawing or lie on one another; empty when all can be read."""
        return list(self.evaluate(_COLLIDING))

    def screenshot(self, path: Path) -> Path:
        """The whole page as a PNG."""
        shot = self.browser.call(
            "Page.captureScreenshot", self.session, format="png", captureBeyondViewport=True
        )
        path.write_bytes(base64.b64decode(shot["data"]))
        return path

    def pdf(self, path: Path) -> Path:
        """The page as it prints on A4; the view shows the print style from then on."""
        self.browser.call("Emulation.setEmulatedMedia", self.session, media="print")
        printed = self.browser.call("Page.printToPDF", self.session, paperWidth=8.27, paperHeight=11.69)
        path.write_bytes(base64.b64decode(printed["data"]))
        return path


class Browser:
    """A running Chromium with a profile of its own; use as a context manager."""

    def __init__(self) -> None:
        program = find_chromium()
        self._profile = tempfile.mkdtemp(prefix="mrctl-chromium-")
        down_read, self._write = os.pipe()
        self._read, up_write = os.pipe()
        command = [program, *_FLAGS, f"--user-data-dir={self._profile}", "about:blank"]
        # The protocol's pipes must be the file descriptors 3 and 4.
        self._process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{down_read} 4>&{up_write}', "bash", *command],
            pass_fds=(down_read, up_write),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(down_read)
        os.close(up_write)
        self._buffer = b""
        self._next = 0
        self._events: list[dict[str, Any]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the browser and every process that it started."""
        os.close(self._write)
        os.close(self._read)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=5)
        with suppress(ProcessLookupError):  # its helpers may outlive it, and still write into the profile
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        shutil.rmtree(self._profile, ignore_errors=True)

    def call(self, method: str, session: str = "", **params: Any) -> dict[str, Any]:
        """Sends a command and waits for its answer; events that come meanwhile are kept."""
        self._next += 1
        message: dict[str, Any] = {"id": self._next, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + _TIMEOUT_S
        while True:
            answer = self._receive(deadline)
            if answer.get("id") != self._next:
                self._events.append(answer)
                continue
            if "error" in answer:
                raise AssertionError(f"{method}: {answer['error']}")
            return dict(answer["result"])

    def _receive(self, deadline: float) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], max(0.0, deadline - time.monotonic()))
            data = os.read(self._read, 1 << 20) if ready else b""
            if not data:
                raise AssertionError("Chromium does not answer" if not ready else "Chromium ended by itself")
            self._buffer += data
        line, _, self._buffer = self._buffer.partition(b"\0")
        return dict(json.loads(line))

    def _wait_for(self, method: str, session: str) -> None:
        deadline = time.monotonic() + _TIMEOUT_S
        while not any(e.get("method") == method and e.get("sessionId") == session for e in self._events):
            self._events.append(self._receive(deadline))

    @contextmanager
    def open(
        self, path: Path, *, width: int = 1200, height: int = 900, dark: bool = False, media: str = "screen"
    ) -> Iterator[View]:
        """Opens a file at a screen size and theme; widths below 600 px are a phone."""
        phone = width < 600
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable", session)
        self.call(
            "Emulation.setDeviceMetricsOverride",
            session,
            width=width,
            height=height,
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", session, media=media, features=[theme])
        self._events.clear()
        url = path.resolve().as_uri()
        self.call("Page.navigate", session, url=url)
        self._wait_for("Page.loadEventFired", session)
        view = View(self, session)
        self.call("Runtime.evaluate", session, expression="1")  # all events before its answer are here
        for event in (e for e in self._events if e.get("sessionId") == session):
            _note(event, view, url)
        yield view
        self.call("Target.closeTarget", targetId=target)


def _note(event: dict[str, Any], view: View, url: str) -> None:
    """Sorts an event into the view's errors or requests."""
    params = event.get("params", {})
    match event["method"]:
        case "Runtime.exceptionThrown":
            view.errors.append(str(params["exceptionDetails"]))
        case "Runtime.consoleAPICalled" if params["type"] in {"error", "warning", "assert"}:
            view.errors.append(str(params["args"]))
        case "Log.entryAdded" if params["entry"]["level"] in {"error", "warning"}:
            view.errors.append(params["entry"]["text"])
        case "Network.requestWillBeSent":
            wanted = params["request"]["url"]
            if wanted != url and not wanted.startswith("data:"):
                view.requests.append(wanted)
