"""Drives pages in headless Chromium by the DevTools protocol, over a pair of pipes.

A message is JSON that ends in a NUL byte. Chromium reads commands from descriptor 3, and
writes its answers and events to descriptor 4.
"""
from __future__ import annotations

import base64
import io
import json
import os
import shutil
import signal
import tempfile
import time
from fcntl import F_DUPFD_CLOEXEC, fcntl
from pathlib import Path
from select import select
from typing import Any

import numpy as np
from PIL import Image

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
                None)
SWIFTSHADER = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
               "--enable-unsafe-swiftshader", "--window-size=1200,900")
KEYS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Space": 32,
        "Enter": 13}


class Browser:
    """A page in a new browser. Use the object in a ``with`` block."""

    def __init__(self, *options: str, width: int = 1200, height: int = 900) -> None:
        assert CHROMIUM is not None
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        pipes = [fcntl(end, F_DUPFD_CLOEXEC, 10) for end in (*os.pipe(), *os.pipe())]
        theirs, self._out, self._in, ours = pipes
        null = os.open(os.devnull, os.O_RDWR)
        self.process = os.posix_spawn(
            CHROMIUM, [CHROMIUM, *SWIFTSHADER, "--remote-debugging-pipe",
                       f"--user-data-dir={self._profile.name}", *options, "about:blank"],
            os.environ, setpgroup=0, file_actions=[
                *((os.POSIX_SPAWN_DUP2, null, to) for to in (0, 1, 2)),
                (os.POSIX_SPAWN_DUP2, theirs, 3), (os.POSIX_SPAWN_DUP2, ours, 4)])
        for end in (theirs, ours, null):
            os.close(end)
        self._sent, self._buffer, self._session = 0, b"", None
        self.errors: list[str] = []     # errors of scripts that no script caught
        targets = self.send("Target.getTargets")["targetInfos"]
        target = next(one["targetId"] for one in targets if one["type"] == "page")
        self._session = self.send("Target.attachToTarget", targetId=target,
                                  flatten=True)["sessionId"]
        for domain in ("Page", "Runtime"):
            self.send(f"{domain}.enable")
        self.resize(width, height)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *exception: object) -> None:
        os.killpg(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)
        for end in (self._in, self._out):
            os.close(end)
        self._profile.cleanup()

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Sends a command and returns its result. An error of the protocol makes the test fail."""
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while (found := self._receive()).get("id") != self._sent:
            if found.get("method") == "Runtime.exceptionThrown":
                self.errors.append(str(found["params"]["exceptionDetails"]))
        assert "error" not in found, (method, found["error"])
        return found["result"]

    def _receive(self, seconds: float = 120) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            assert select([self._in], [], [], seconds)[0], "the browser does not answer"
            read = os.read(self._in, 1 << 20)
            assert read, "the browser has ended"
            self._buffer += read
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def resize(self, width: int, height: int) -> None:
        """Sets the size of the window's content, in pixels."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=False)

    def open(self, path: Path, choices: str = "") -> None:
        """Loads a page anew, even if only the part of its address after "#" differs."""
        self.send("Page.navigate", url="about:blank")
        self.send("Page.navigate", url=f"file://{path}#{choices}")
        self.wait("document.readyState === 'complete'")

    def run(self, expression: str) -> Any:
        """Returns the value of an expression in the page. If the value is a promise, waits for its
        result."""
        found = self.send("Runtime.evaluate", expression=expression, returnByValue=True,
                          awaitPromise=True, userGesture=True)
        assert "exceptionDetails" not in found, (expression, found["exceptionDetails"])
        return found["result"].get("value")

    def wait(self, expression: str, seconds: float = 120) -> Any:
        """Returns the value of an expression as soon as the value is true."""
        end = time.monotonic() + seconds
        while not (found := self.run(expression)):
            assert not self.errors, self.errors
            assert time.monotonic() < end, f"after {seconds} s not yet: {expression}"
            time.sleep(0.02)
        return found

    def box(self, selector: str) -> tuple[float, float, float, float]:
        """Returns an element's left, top, width and height, after it was scrolled into view."""
        return tuple(self.run(
            f"(() => {{ const one = document.querySelector({json.dumps(selector)});"
            "one.scrollIntoView({block: 'nearest'}); const box = one.getBoundingClientRect();"
            "return [box.x, box.y, box.width, box.height]; })()"))

    def mouse(self, kind: str, x: float, y: float, button: str = "left") -> None:
        """Sends a mouse event: pressed, moved (with the button held) or released."""
        self.send("Input.dispatchMouseEvent", type=f"mouse{kind.capitalize()}", x=x, y=y,
                  button=button, buttons=int(kind != "released"), clickCount=1)

    def wheel(self, x: float, y: float, pixels: float) -> None:
        """Turns the mouse wheel at a point. Negative pixels turn it away from the reader."""
        self.send("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=pixels)

    def drag(self, selector: str, start: tuple[float, float], *ends: tuple[float, float]) -> None:
        """Drags over an element. A point (x, y) gives shares of the element's width and height."""
        left, top, width, height = self.box(selector)
        places = [(left + x * width, top + y * height) for x, y in (start, *ends)]
        self.mouse("pressed", *places[0])
        for place in places[1:]:
            self.mouse("moved", *place)
        self.mouse("released", *places[-1])

    def click(self, selector: str, at: tuple[float, float] = (0.5, 0.5)) -> None:
        """Clicks an element at a point, given as shares of the element's width and height."""
        self.drag(selector, at)

    def press(self, key: str, times: int = 1) -> None:
        """Presses and releases a key, which the focused element receives."""
        for _ in range(times):
            for kind in ("rawKeyDown", "keyUp"):
                self.send("Input.dispatchKeyEvent", type=kind, key=key, code=key,
                          windowsVirtualKeyCode=KEYS[key])

    def select(self, selector: str, value: str) -> None:
        """Chooses an option of a list by the arrow keys."""
        at = (f"(() => {{ const one = document.querySelector({json.dumps(selector)}); one.focus();"
              f"return [...one.options].findIndex(o => o.text === {json.dumps(value)})"
              " - one.selectedIndex; })()")
        steps = self.run(at)
        self.press("ArrowDown" if steps > 0 else "ArrowUp", abs(steps))
        assert self.run(at) == 0, f"{selector} has no option {value}"

    def pixels(self, selector: str | None = None) -> np.ndarray:
        """Returns a screenshot of an element, or of the page, as (height, width, 3) integers."""
        clip = {}
        if selector is not None:
            left, top, width, height = self.box(selector)
            x, y = self.run("[scrollX, scrollY]")
            clip["clip"] = dict(x=left + x, y=top + y, width=width, height=height, scale=1)
        data = self.send("Page.captureScreenshot", format="png", **clip)["data"]
        picture = Image.open(io.BytesIO(base64.b64decode(data)))
        return np.asarray(picture.convert("RGB")).astype(int)
