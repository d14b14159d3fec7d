"""A download ends with the right file or with an error of one line. The next call continues an
interrupted download."""
from __future__ import annotations

import hashlib
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.scene.originals import download as module
from gpgpu_rt.scene.originals.download import download
from gpgpu_rt.scene.originals.sources import SourceFile, source_files

CONTENT = np.random.default_rng(1).bytes(300_000)


def source_file(content: bytes = CONTENT) -> SourceFile:
    return SourceFile("soup", "owner/meshes", "0" * 40, "a folder/soup é.bin", len(content),
                      hashlib.sha256(content).hexdigest(), "free")


class Server(http.server.ThreadingHTTPServer):
    """Serves one file.

    ``drops`` has an entry for each of the next connections: the number of bytes after which the
    server closes the connection. ``statuses`` has the HTTP status of each of the next answers.
    ``asked`` and ``paths`` collect the requested ranges and paths.
    """

    def __init__(self, content: bytes, ranges: bool = True) -> None:
        super().__init__(("127.0.0.1", 0), Answer)
        self.content, self.ranges = content, ranges
        self.drops: list[int] = []
        self.statuses: list[int] = []
        self.asked: list[str | None] = []
        self.paths: list[str] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/copy"

    def handle_error(self, request, client_address) -> None:
        pass


class Answer(http.server.BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        server, wanted = self.server, self.headers.get("Range")
        server.asked.append(wanted)
        server.paths.append(self.path)
        if server.statuses:
            return self.send_error(server.statuses.pop(0))
        start = int(wanted[6:-1]) if wanted and server.ranges else 0
        body = server.content[start:]
        if wanted and server.ranges and not body:
            return self.send_error(416)
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range",
                             f"bytes {start}-{len(server.content) - 1}/{len(server.content)}")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body[:server.drops.pop(0)] if server.drops else body)

    def log_message(self, *words) -> None:
        pass


@pytest.fixture
def serve(monkeypatch) -> Iterator:
    monkeypatch.setattr(module, "FIRST_WAIT", 0.001)
    running = []

    def start(content: bytes = CONTENT, **options) -> Server:
        server = Server(content, **options)
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        running.append(server)
        return server

    yield start
    for server in running:
        server.shutdown()
        server.server_close()


def fetched(file: SourceFile, base: str, partial: Path, report=lambda there: None) -> bytes:
    download(file, base, partial, report)
    return partial.read_bytes()


@pytest.mark.parametrize("ranges", [True, False])
def test_the_whole_file(serve, ranges: bool, tmp_path) -> None:
    server, seen = serve(ranges=ranges), []
    assert fetched(source_file(), server.url, tmp_path / "part", seen.append) == CONTENT
    assert seen == sorted(seen) and seen[-1] == len(CONTENT)
    assert server.paths == ["/copy/meshes/a%20folder/soup%20%C3%A9.bin"]
    assert fetched(source_file(), server.url, tmp_path / "part") == CONTENT
    assert len(server.asked) == 1       # a complete file is not requested again


def test_a_folder(tmp_path) -> None:
    place = tmp_path / source_file().place
    place.parent.mkdir(parents=True)
    place.write_bytes(CONTENT)
    assert fetched(source_file(), str(tmp_path), tmp_path / "part") == CONTENT
    place.unlink()
    with pytest.raises(rt.Error, match="has no file meshes/a folder/soup"):
        download(source_file(), str(tmp_path), tmp_path / "other", lambda there: None)


@pytest.mark.parametrize("ranges", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_an_interrupted_download_continues(serve, seed: int, ranges: bool, tmp_path) -> None:
    """The user interrupts the download at a random byte. The next run requests the rest of the
    file."""
    server = serve(ranges=ranges)
    moment = int(np.random.default_rng(seed).integers(1, len(CONTENT)))

    def interrupt(there: int) -> None:
        if there >= moment:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        download(source_file(), server.url, tmp_path / "part", interrupt)
    there = (tmp_path / "part").stat().st_size
    assert moment <= there <= len(CONTENT)
    assert fetched(source_file(), server.url, tmp_path / "part") == CONTENT
    if there < len(CONTENT):
        assert server.asked == [None, f"bytes={there}-"]


@pytest.mark.parametrize("seed", range(10))
def test_a_lost_connection_is_made_again(serve, seed: int, tmp_path) -> None:
    server = serve()
    server.drops = np.random.default_rng(seed).integers(1, 60_000, 12).tolist()
    assert fetched(source_file(), server.url, tmp_path / "part") == CONTENT
    assert len(server.asked) > 2


def test_a_server_that_recovers(serve, tmp_path) -> None:
    """A download succeeds after the answers 503 and 429, which ask to try again later."""
    server = serve()
    server.statuses = [503, 429]
    assert fetched(source_file(), server.url, tmp_path / "part") == CONTENT


@pytest.mark.parametrize("seed", range(50))
def test_a_damaged_file_is_refused_and_not_kept(serve, seed: int, tmp_path) -> None:
    rng = np.random.default_rng(seed)
    at = int(rng.integers(len(CONTENT)))
    damaged = [CONTENT[:at],
               CONTENT[:at] + bytes([CONTENT[at] ^ 1]) + CONTENT[at + 1:],
               rng.bytes(int(rng.integers(1, 2 * len(CONTENT)))),
               b"<html>no such page</html>",
               CONTENT + rng.bytes(int(rng.integers(1, 9_000_000)))][seed % 5]
    server = serve(damaged, ranges=bool(seed // 5 % 2))
    if seed // 10 % 2:       # an earlier run has written the first bytes
        (tmp_path / "part").write_bytes(CONTENT[:at // 2])
    with pytest.raises(rt.Error) as refused:
        download(source_file(), server.url, tmp_path / "part", lambda there: None)
    line = str(refused.value)
    assert "\n" not in line and "nothing of it is kept" in line
    assert source_file().sha256 in line and source_file().location(server.url) in line
    if len(damaged) <= module.LARGEST * len(CONTENT):
        assert hashlib.sha256(damaged).hexdigest() in line
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("seed", range(3))
def test_a_damaged_part_is_fetched_anew(serve, seed: int, tmp_path) -> None:
    rng = np.random.default_rng(seed)
    (tmp_path / "part").write_bytes(rng.bytes(int(rng.integers(1, 2 * len(CONTENT)))))
    assert fetched(source_file(), serve().url, tmp_path / "part") == CONTENT


def test_without_a_network(tmp_path) -> None:
    for base, message in (("http://127.0.0.1:9", "cannot reach .*--from FOLDER"),
                          ("ftp://example.org", "neither a folder nor a URL"),
                          ("http://h:abc", "is no valid URL"),
                          ("http://[bad", "is no valid URL"),
                          (str(tmp_path / "gone"), "has no file")):
        with pytest.raises(rt.Error, match=message) as refused:
            download(source_file(), base, tmp_path / "part", lambda there: None)
        assert "\n" not in str(refused.value) and not list(tmp_path.iterdir())


def test_a_missing_file_and_a_server_that_never_ends_well(serve, tmp_path) -> None:
    """The answer 404 ends the download at once, and the answer 503 after TRIES attempts."""
    server = serve()
    server.statuses = [404]
    with pytest.raises(rt.Error, match="the server answers 404 .*--from"):
        download(source_file(), server.url, tmp_path / "part", lambda there: None)
    assert len(server.asked) == 1 and not list(tmp_path.iterdir())
    server.statuses = [503] * module.TRIES
    with pytest.raises(rt.Error, match="503.*again to continue"):
        download(source_file(), server.url, tmp_path / "part", lambda there: None)


def test_sources() -> None:
    """Every source is pinned to a commit and a digest, and all files have different paths."""
    files = [file for scene in source_files().values() for file in scene]
    assert len({file.place for file in files}) == len(files)
    for file in files:
        assert len(file.commit) == 40 and len(file.sha256) == 64 and file.size > 0 and file.terms
        assert file.location(None).startswith("https://") and " " not in file.location(None)
        assert ".." not in file.place.parts and not file.place.is_absolute()
