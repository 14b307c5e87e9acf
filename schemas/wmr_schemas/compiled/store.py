"""Compiled functions as files: one for each signature, written whole or not at all."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

DIGEST_BYTES = 32
"""Each file begins with the digest of the rest."""


def file_of(directory: Path, function: str, signature: str) -> Path:
    """The file of one compiled signature."""
    name = "".join(c if c.isalnum() or c in "._" else "-" for c in function)
    return directory / f"{name[-80:]}.{hashlib.sha256(f'{function} {signature}'.encode()).hexdigest()[:20]}"


def read(file: Path) -> bytes | None:
    """The content, or None where there is none or it is damaged."""
    try:
        kept = file.read_bytes()
    except OSError:
        return None
    content = kept[DIGEST_BYTES:]
    return content if hashlib.sha256(content).digest() == kept[:DIGEST_BYTES] else None


def write(file: Path, content: bytes) -> None:
    """Put a file in place at once, so that a process beside sees all of it or nothing.

    Without room or permission nothing is kept: the next process compiles again.
    """
    name = None
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, prefix="part-", delete=False) as part:
            name = part.name
            part.write(hashlib.sha256(content).digest() + content)
        os.replace(name, file)  # noqa: PTH105 – a Path would be made of it for nothing
    except OSError:
        if name is not None:
            with contextlib.suppress(OSError):
                os.unlink(name)  # noqa: PTH108
