"""Acts on a window as a desktop does: drops a file on it (XDND protocol) or asks it to close.

Run ``python x_client.py drop WINDOW PATH`` or ``python x_client.py close WINDOW``. The environment
variable ``DISPLAY`` names the X server.
"""
from __future__ import annotations

import ctypes
import sys
import time
from pathlib import Path

from pyglet.libs.x11 import xlib

VERSION = 5
XA_ATOM = 4
PATIENCE = 120.0


class Client:
    """An X connection that has its own window and acts on another window."""

    def __init__(self, window: int) -> None:
        self.display = xlib.XOpenDisplay(None)
        assert self.display, "no display"
        self.other = window
        self.own = xlib.XCreateSimpleWindow(
            self.display, xlib.XDefaultRootWindow(self.display), 0, 0, 1, 1, 0, 0, 0)

    def atom(self, name: str) -> int:
        return xlib.XInternAtom(self.display, name.encode(), False)

    def tell(self, name: str, *data: int) -> None:
        """Sends the window a client message."""
        event = xlib.XEvent()
        message = event.xclient
        message.type, message.window, message.format = xlib.ClientMessage, self.other, 32
        message.message_type = self.atom(name)
        for k, value in enumerate(data):
            message.data.l[k] = value
        self._send(self.other, event)

    def close(self) -> None:
        self.tell("WM_PROTOCOLS", self.atom("WM_DELETE_WINDOW"), 0)

    def drop(self, path: str, x: int = 300, y: int = 200) -> None:
        """Drops a file, and answers the window's requests until the window reports the end of the
        drop."""
        uri = self.atom("text/uri-list")
        xlib.XSetSelectionOwner(self.display, self.atom("XdndSelection"), self.own, 0)
        types = (ctypes.c_ulong * 4)(uri, *map(self.atom, ("text/plain", "STRING", "TEXT")))
        xlib.XChangeProperty(self.display, self.own, self.atom("XdndTypeList"), XA_ATOM, 32, 0,
                             ctypes.cast(types, ctypes.POINTER(ctypes.c_ubyte)), len(types))
        self.tell("XdndEnter", self.own, VERSION << 24 | 1, uri)  # 1: XdndTypeList exists
        self.tell("XdndPosition", self.own, 0, x << 16 | y, 0, self.atom("XdndActionCopy"))
        status = self._until("XdndStatus")
        assert status.data.l[1] & 1, "the window refuses the file"
        self.tell("XdndDrop", self.own, 0, 0)
        self._until("XdndFinished", (Path(path).as_uri() + "\r\n").encode())

    def _until(self, name: str, text: bytes = b"") -> xlib.XClientMessageEvent:
        """Waits for the message ``name`` and returns it. While waiting, answers requests for the
        selection with ``text``."""
        began, event = time.monotonic(), xlib.XEvent()
        while time.monotonic() - began < PATIENCE:
            if not xlib.XPending(self.display):
                time.sleep(0.02)
                continue
            xlib.XNextEvent(self.display, ctypes.byref(event))
            if event.type == xlib.SelectionRequest:
                self._give(event.xselectionrequest, text)
            elif (event.type == xlib.ClientMessage
                  and event.xclient.message_type == self.atom(name)):
                return event.xclient
        raise TimeoutError(f"no {name}")

    def _give(self, asked: xlib.XSelectionRequestEvent, text: bytes) -> None:
        """Answers a request for the selection with ``text``."""
        data = (ctypes.c_ubyte * len(text)).from_buffer_copy(text)
        xlib.XChangeProperty(self.display, asked.requestor, asked.property, asked.target, 8,
                             0, data, len(text))
        event = xlib.XEvent()
        answer = event.xselection
        answer.type, answer.requestor, answer.selection = (
            xlib.SelectionNotify, asked.requestor, asked.selection)
        answer.target, answer.property, answer.time = asked.target, asked.property, asked.time
        self._send(asked.requestor, event)

    def _send(self, window: int, event: xlib.XEvent) -> None:
        xlib.XSendEvent(self.display, window, False, 0, ctypes.byref(event))
        xlib.XFlush(self.display)


if __name__ == "__main__":
    what, number, *words = sys.argv[1:]
    getattr(Client(int(number)), what)(*words)
