"""Many logs at once, into one dataset."""

import os
from collections.abc import Sequence
from typing import Unpack

from wmr_replay.api.places import Place, place_of
from wmr_replay.api.request import (
    Instant,
    MappingLike,
    ModelLike,
    SettingsArguments,
    between_of,
    mapping_of,
    model_of,
    settings_of,
)
from wmr_replay.fleet.batch import BatchResult, Progress, run_batch
from wmr_replay.fleet.job import Orders, Outcome
from wmr_replay.fleet.summary import fleet_json, totals
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model

__all__ = ["BatchResult", "Outcome", "Progress", "batch", "fleet_json", "totals"]


def batch(
    logs: Place | Sequence[Place],
    out: Place,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    model: ModelLike | None = None,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    timeline: bool = False,
    report: bool = False,
    strict: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[SettingsArguments],
) -> BatchResult:
    """Replay many logs into one dataset. A log that fails stops no other; what is done already is skipped.

    Args:
        logs: Files, rosbag2 directories, directories to search, patterns, URLs.
        out: Directory or URL of the dataset; it grows with each batch.
        jobs: Processes; None: one per core.
        scheduler: Address of a Dask scheduler whose workers do the work instead.
        model: Model or model file.
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        timeline: Whether to write a Rerun timeline per log too.
        report: Whether to write a page per log and one of the fleet, ``report.html`` (extra ``report``).
        strict: Whether a log in which something was damaged has failed.
        progress: Called with the outcome of each log, bytes done and bytes in all.
        **settings: Fields of ``wmr_replay.Settings``.

    Raises:
        InvalidSetting: No log at a place, a dataset in use, or a setting that makes no sense.
        MissingExtra: The scheduler or a URL needs an extra that is not installed.
    """
    places = [logs] if isinstance(logs, str) or not isinstance(logs, Sequence) else list(logs)
    orders = Orders(
        settings_of(settings),
        mapping_of(mapping) or LogMapping(),
        between_of(start, end),
        model_of(model) or Model(),
        timeline=timeline,
        strict=strict,
    )
    return run_batch(
        [place_of(place) for place in places],
        place_of(out),
        orders,
        n_jobs=jobs or os.cpu_count() or 1,
        scheduler=scheduler,
        report=report,
        progress=progress,
    )
