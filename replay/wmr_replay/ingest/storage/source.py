"""Where a log lies: a path on this machine, or a URL whose bytes are fetched range by range.

:class:`RemotePath` answers as far as ingest asks a ``pathlib.Path``, so that the code behind it is
the same for both. Protocols are those of fsspec; ``s3://`` uses Arrow's own client.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, cast
from urllib.parse import urlsplit

from wmr_replay.ingest.storage.range_file import NETWORK, RangeFile
from wmr_schemas.errors import LogUnusable, MissingExtra

SEPARATOR = "://"
REQUEST_S, CONNECT_S = 60, 10


def is_url(text: str) -> bool:
    """Whether a text is a URL and no path."""
    scheme, separator, _ = text.partition(SEPARATOR)
    return bool(separator) and scheme.isalnum()


@dataclass(frozen=True, order=True)
class RemotePath:
    """A file or folder behind a URL. As text, and wherever it is written down, without password and query."""

    url: str

    def __str__(self) -> str:
        parts = urlsplit(self.url)
        if not parts.netloc:
            return self.url
        return f"{parts.scheme}{SEPARATOR}{parts.netloc.rpartition('@')[2]}{parts.path}"

    def __reduce__(self) -> tuple[type["RemotePath"], tuple[str]]:
        return RemotePath, (self.url,)

    @property
    def name(self) -> str:
        """The last piece of the path."""
        return str(self).rstrip("/").rpartition("/")[2]

    @property
    def stem(self) -> str:
        """The name without its last ending."""
        return Path(self.name).stem

    def __truediv__(self, name: str) -> "RemotePath":
        bare, mark, query = self.url.partition("?")
        return RemotePath(f"{bare.rstrip('/')}/{name}{mark}{query}")

    def with_name(self, name: str) -> "RemotePath":
        """The file of that name beside this one."""
        bare, mark, query = self.url.partition("?")
        return RemotePath(f"{bare.rstrip('/').rpartition('/')[0]}/{name}{mark}{query}")

    def is_file(self) -> bool:
        """Whether there is such a file."""
        try:
            return bool(self.details["type"] == "file")
        except LogUnusable:
            return False

    def is_dir(self) -> bool:
        """Whether it is a folder; a web server does not tell, so there it never is."""
        if self.url.startswith("http"):
            return False
        system, path = located(self)
        try:
            return bool(system.isdir(path))
        except OSError as error:
            raise unreachable(self, error) from None

    def walk(self) -> Iterator["RemotePath"]:
        """All files below this folder, by name."""
        system, path = located(self)
        for found in sorted(system.find(path)):
            yield RemotePath(system.unstrip_protocol(found) if SEPARATOR not in found else found)

    def glob(self, pattern: str) -> Iterator["RemotePath"]:
        """The files directly in this folder whose names match."""
        depth = str(self).rstrip("/").count("/") + 1
        for file in self.walk():
            if str(file).count("/") == depth and Path(file.name).match(pattern):
                yield file

    @cached_property
    def details(self) -> dict[str, Any]:
        """What the other side says of the file: ``size``, ``ETag`` … Asked once. Raises LogUnusable."""
        system, path = located(self)
        try:
            return dict(system.info(path))
        except Exception as error:
            raise unreachable(self, error) from None

    def open(self, mode: str = "rb") -> BinaryIO:
        """Open the file for reading; every ``read`` fetches exactly the bytes that it asks for."""
        size, (system, path) = size_of(self), located(self)
        try:
            file = system.open(path, "rb", cache_type="none", size=size)
        except Exception as error:
            raise unreachable(self, error) from None
        return cast("BinaryIO", RangeFile(self, file, size))

    def read_text(self, encoding: str = "utf-8", errors: str = "strict") -> str:
        """The content of a small file."""
        system, path = located(self)
        try:
            return bytes(system.cat_file(path)).decode(encoding, errors)
        except Exception as error:
            raise unreachable(self, error) from None


LogPath: TypeAlias = Path | RemotePath


def log_path(text: str) -> LogPath:
    """The place that a user's text means: a URL or a path."""
    return RemotePath(text) if is_url(text) else Path(text)


def size_of(path: LogPath) -> int:
    """Size of a file in bytes. Raises LogUnusable for a URL that does not tell."""
    if isinstance(path, Path):
        return path.stat().st_size
    size = path.details.get("size")
    if size is None:
        raise LogUnusable(path, "the server does not tell the file's size", "Download it first.")
    return int(size)


def unreachable(path: RemotePath, error: Exception) -> LogUnusable:
    """The error for a URL that yields nothing."""
    if isinstance(error, FileNotFoundError):
        return LogUnusable(path, "there is no such file", NETWORK)
    return LogUnusable(path, f"cannot be fetched ({type(error).__name__}: {error})", NETWORK)


def located(path: RemotePath) -> tuple[Any, str]:
    """Fsspec's file system and the path in it. Raises MissingExtra, LogUnusable."""
    try:
        return _located(path.url)
    except ImportError as error:
        raise MissingExtra("remote", f"{path.url.partition(SEPARATOR)[0]}{SEPARATOR}", error.name) from None
    except ValueError as error:
        raise LogUnusable(path, f"is no URL that can be read ({error})", NETWORK) from None


@lru_cache(maxsize=256)
def _located(url: str) -> tuple[Any, str]:
    """Fsspec's file system and the path in it, kept for the next call."""
    from fsspec.core import url_to_fs  # noqa: PLC0415 – an extra

    if url.startswith(("s3://", "s3a://")):
        return _s3(), url.partition(SEPARATOR)[2]
    system, path = url_to_fs(url)
    return system, str(path)


@lru_cache(maxsize=1)
def _s3() -> Any:
    """Settings come from AWS's usual environment variables and files, ``AWS_ENDPOINT_URL`` among them."""
    from fsspec.implementations.arrow import ArrowFSWrapper  # noqa: PLC0415
    from pyarrow.fs import S3FileSystem  # noqa: PLC0415

    endpoint = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL")
    return ArrowFSWrapper(
        S3FileSystem(endpoint_override=endpoint, request_timeout=REQUEST_S, connect_timeout=CONNECT_S)
    )


def gives_ranges(path: RemotePath) -> bool:
    """Whether the server gives parts of the file."""
    if path.details.get("partial") is False or path.details.get("size") is None:
        return False
    try:
        with path.open() as file:
            file.seek(1)
            file.read(1)
    except ValueError:
        return False
    return True


def download(path: RemotePath, copy: Path) -> None:
    """Fetch the whole file into ``copy``. Raises LogUnusable."""
    system, inside = located(path)
    try:
        system.get_file(inside, str(copy))
    except Exception as error:
        raise unreachable(path, error) from None
