"""One log of a batch: the request, its identity and its outcome."""

import hashlib
import json
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from wmr_replay.ingest import Between, LogPath, RemotePath, sha256_of
from wmr_replay.ingest.storage.bag import bag_files
from wmr_replay.ingest.storage.source import size_of
from wmr_replay.pipeline.settings import Settings
from wmr_schemas import __version__
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model

_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_MAX_STEM = 100
_SIDE_FILES = ("truth.json", "truth.parquet")


@dataclass(frozen=True)
class Orders:
    """The request that a batch makes of every log: settings, mapping, limits, model, outputs."""

    settings: Settings = field(default_factory=Settings)
    mapping: LogMapping = field(default_factory=LogMapping)
    between: Between = field(default_factory=Between)
    model: Model = field(default_factory=Model)
    timeline: bool = False
    strict: bool = False

    def as_text(self) -> str:
        """Everything that decides the tables, besides the log, as one text. A timeline decides none."""
        decides = asdict(self) | {"timeline": False, "version": __version__}
        return json.dumps(decides, sort_keys=True, default=str)


@dataclass(frozen=True)
class Job:
    """A log with its hash. ``key`` names its partition, ``task`` stands for log, orders and version."""

    log: LogPath
    sha256: str
    size_bytes: int
    key: str
    task: str
    orders: Orders
    version: str = __version__


@dataclass(frozen=True)
class Outcome:
    """The outcome of a log: ``problem`` as `run` prints it, empty on success; ``skipped``: done before."""

    log: str
    key: str = ""
    problem: str = ""
    skipped: bool = False
    same_as: str = ""


def make_job(log: LogPath, orders: Orders) -> Job:
    """Read a log once for its hash. Raises LogUnusable."""
    sha256 = sha256_of(log)
    size = sum(size_of(part) for part in bag_files(log))
    task = hashlib.sha256("\n".join([sha256, orders.as_text(), *side_hashes(log)]).encode()).hexdigest()
    return Job(log, sha256, size, partition_key(log, sha256), task, orders)


def partition_key(log: LogPath, sha256: str) -> str:
    """``<stem>-<twelve digits of the hash>``: the name of the log's partition, safe in paths and URLs."""
    return f"{_UNSAFE.sub('_', log.stem)[:_MAX_STEM] or 'log'}-{sha256[:12]}"


def side_hashes(log: LogPath) -> list[str]:
    """Hashes of the side files that a run reads for scoring; they are part of what a result depends on."""
    if isinstance(log, RemotePath):
        return []
    files = [log.with_name(f"{log.stem}.{ending}") for ending in _SIDE_FILES]
    return [file_sha256(file) for file in files if file.is_file()]


def file_sha256(path: Path) -> str:
    """Hash of one file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def as_record(job: Job, files: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The completion record: written last, it says that these files are the whole result."""
    facts = {"log": str(job.log), "key": job.key, "log_sha256": job.sha256, "task": job.task}
    return {**facts, "version": job.version, "files": files}
