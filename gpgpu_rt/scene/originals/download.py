"""Download: gets a file from a web server or a folder, and checks its size and digest."""
from __future__ import annotations

import hashlib
import http.client
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

from ...disk.files import open_input
from ...errors import Error, OptionError
from .sources import SourceFile, is_url

TRIES = 5              # a download fails after this many connections in a row without a new byte
# Seconds before the next connection. Each connection without a new byte doubles the wait.
FIRST_WAIT = 0.2
SECONDS = 30           # longest wait for an answer of the server
BLOCK = 1 << 16        # bytes
# If the file has changed on the server, read the whole file, so that the message can name the
# digest. But stop at this multiple of the expected size.
LARGEST = 4
_AGAIN = (408, 425, 429, 500, 502, 503, 504)     # HTTP statuses of a server that may recover

Report = Callable[[int], None]    # called with the number of bytes so far


class _Lost(Exception):
    """The connection ended early, for the reason in the text."""


class _Incoming:
    """The bytes of a file from a server or a folder.

    Attributes
    ----------
    start : position of the first byte in the file
    total : size of the whole file in bytes, or None
    """

    def __init__(self, source: str, start: int) -> None:
        self.start, self.total = 0, None
        if not is_url(source):
            self._file = open_input(source)
            self._file.seek(start)
            self.start = start
            return
        headers = {"User-Agent": "gpgpu_rt", "Accept-Encoding": "identity"}
        if start:
            headers["Range"] = f"bytes={start}-"
        request = urllib.request.Request(source, headers=headers)
        self._file = urllib.request.urlopen(request, timeout=SECONDS)
        length = self._file.headers.get("Content-Length", "")
        self.total = _count(length)
        if self._file.status == 206:
            content = self._file.headers.get("Content-Range", "")    # such as bytes 5-9/10
            first, _, total = content.removeprefix("bytes ").partition("-")
            total = total.rpartition("/")[2]
            if first != str(start):
                self._file.close()
                raise _Lost(f"the server answered with the range {content[:40]!r}, not from byte "
                            f"{start}")
            self.start, self.total = start, _count(total)

    def blocks(self) -> Iterator[bytes]:
        """Yield the bytes in blocks."""
        at = self.start
        while block := self._file.read(BLOCK):
            at += len(block)
            yield block
        if self.total is not None and at < self.total:
            raise _Lost(f"the connection ended after {at:,} of {self.total:,} bytes")

    def close(self) -> None:
        self._file.close()


def download(file: SourceFile, base: str | None, partial: Path, report: Report) -> None:
    """Download a file to ``partial``, or continue an earlier download.

    Parameters
    ----------
    file : the file to download
    base : URL or folder of a copy of the originals; None for the file's own repository
    partial : the path to write. An interrupted download stays there for a later call. A file with
        the wrong size or digest is removed
    report : a function that shows the progress

    Raises
    ------
    Error
        the file cannot be downloaded, or is not the expected file
    """
    source = file.location(base)
    if is_url(source) and not source.startswith(("http://", "https://")):
        raise OptionError(f"{base} is neither a folder nor a URL of http or https")
    continued = partial.is_file()
    if continued and partial.stat().st_size > file.size:
        partial.unlink()
    try:
        _read_all(file, source, partial, report)
        found = _digest(partial)
        if found != file.sha256 and continued:    # the earlier part may be damaged
            partial.unlink()
            _read_all(file, source, partial, report)
            found = _digest(partial)
    except Error:
        raise
    except (http.client.InvalidURL, ValueError) as failure:
        raise OptionError(f"{base} is no valid URL ({failure}); check --from") from failure
    except FileNotFoundError as failure:
        raise Error(f"{base} has no file {file.place}; the folder must hold the originals as "
                    "REPOSITORY/PATH") from failure
    except OSError as failure:
        raise Error(f"cannot fetch {file.place}: {failure.strerror or failure}; run the command "
                    "again to continue") from failure
    if found != file.sha256:
        size = partial.stat().st_size
        partial.unlink()
        some = f"{size:,} bytes" if size <= LARGEST * file.size else f"more than {size:,} bytes"
        raise Error(f"{source} is not the expected file, and nothing of it is kept: it has {some} "
                    f"and SHA-256 {found}, but should have {file.size:,} bytes and SHA-256 "
                    f"{file.sha256}; if the file has changed there, name an unchanged copy by "
                    "--from")


def _read_all(file: SourceFile, source: str, partial: Path, report: Report) -> None:
    """Append to ``partial`` until the whole file is there; connect again if a connection ends
    early."""
    failed = 0
    while True:
        before = partial.stat().st_size if partial.is_file() else 0
        if before >= file.size:
            return
        try:
            with closing(_Incoming(source, before)) as stream:
                _append(file, stream, partial, report)
            return
        except urllib.error.HTTPError as failure:
            failure.close()
            said = f"{source}: the server answers {failure.code} {failure.reason}"
            if failure.code == 416:     # the server's file is shorter than ``partial``
                partial.unlink(missing_ok=True)
            elif failure.code not in _AGAIN:
                raise Error(f"{said}; name another source by --from") from None
        except urllib.error.URLError as failure:
            reason = getattr(failure.reason, "strerror", None) or failure.reason
            said = f"cannot reach {source} ({reason})"
            if not before:
                raise Error(f"{said}; check the network, or name a copy by --from FOLDER or "
                            "--from URL") from None
        except http.client.InvalidURL:
            raise
        except (_Lost, http.client.HTTPException, ConnectionError, TimeoutError) as failure:
            said = f"{source}: {failure or type(failure).__name__}"
        now = partial.stat().st_size if partial.is_file() else 0
        failed = 0 if now > before else failed + 1
        if failed == TRIES:
            raise Error(f"{said}; run the command again to continue")
        time.sleep(FIRST_WAIT * 2 ** failed)


def _append(file: SourceFile, stream: _Incoming, partial: Path, report: Report) -> None:
    limit = LARGEST * file.size
    with open(partial, "r+b" if partial.is_file() else "wb") as output:
        output.truncate(stream.start)
        output.seek(stream.start)
        there = stream.start
        for block in stream.blocks():
            output.write(block)
            there += len(block)
            report(min(there, file.size))
            if there > limit:
                return


def _count(text: str) -> int | None:
    """Return a number of bytes from a header, or None."""
    return int(text) if text.isascii() and text.isdecimal() else None


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
