"""Replaying a log as a stored result was made: the request in ``summary.settings``, and changes to it."""

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import polars as pl

from wmr_replay.ingest import Between
from wmr_replay.jobs.run import replay_of
from wmr_replay.pipeline.settings import Settings
from wmr_replay.regress.results import Results
from wmr_replay.tables.summary import summary_frame
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.mapping_file import LogMapping, read_mapping
from wmr_schemas.model_file import Model, read_model
from wmr_schemas.tables import SAMPLES, polars_schema

T = TypeVar("T")


@dataclass(frozen=True)
class Asked:
    """What decides a replay's numbers besides the log."""

    settings: Settings = field(default_factory=Settings)
    mapping: LogMapping | None = None
    between: Between | None = None
    model: Model | None = None

    def changed(
        self,
        changes: Mapping[str, Any],
        mapping: LogMapping | None = None,
        between: Between | None = None,
        model: Model | None = None,
    ) -> "Asked":
        """The same with other settings; a mapping, limits or model given here replace the stored one."""
        return Asked(
            replace(self.settings, **changes),
            mapping or self.mapping,
            between or self.between,
            model or self.model,
        )


@dataclass(frozen=True)
class Changes:
    """Called with a request: the same with these settings, and this mapping, limits or model where given."""

    settings: Mapping[str, Any] = field(default_factory=dict)
    mapping: LogMapping | None = None
    between: Between | None = None
    model: Model | None = None

    def __call__(self, asked: Asked) -> Asked:
        """The changed request."""
        return asked.changed(self.settings, self.mapping, self.between, self.model)


def stored_request(results: Results, source: Path) -> Asked:
    """The request that a stored result was made with. Raises InvalidFile for unreadable settings."""
    try:
        stored = json.loads(results.summary["settings"][0])
        known = {f.name for f in fields(Settings)}
        settings = Settings(**{name: value for name, value in stored.items() if name in known})
        given = dict(stored.get("given", {}))
    except (KeyError, IndexError, TypeError, ValueError, InvalidSetting) as error:
        raise InvalidFile(source, "settings", f"cannot be understood ({error})") from None
    return Asked(
        settings,
        from_text(read_mapping, given.get("mapping")),
        Between(given.get("start"), given.get("end")),
        from_text(read_model, given.get("model")),
    )


def from_text(read: Callable[[Path], T], text: str | None) -> T | None:
    """What ``read`` makes of a file with that text."""
    if not text:
        return None
    with tempfile.TemporaryDirectory(prefix="wmr-replay-") as folder:
        path = Path(folder, "stored.toml")
        path.write_text(text, encoding="utf-8")
        return read(path)


def replay(log: Path, asked: Asked, progress: Callable[[int, int], None] | None = None) -> Results:
    """The tables of a log, replayed now in memory. Raises LogUnusable."""
    replayed = replay_of(
        log, settings=asked.settings, mapping=asked.mapping, between=asked.between, model=asked.model
    )
    samples = pl.concat([pl.DataFrame(schema=polars_schema(SAMPLES)), *replayed.samples(progress)])
    tables = replayed.tables()
    return Results(samples, tables.segments, summary_frame(tables.summary))
