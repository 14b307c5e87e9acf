"""Two results side by side: what differs, by how much, and both in one recording."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import polars as pl

from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.request import SettingsArguments, settings_of, untuned
from wmr_replay.api.result import Result
from wmr_replay.ingest import sha256_of
from wmr_replay.jobs.pair_owner import ENDINGS, PairClaim
from wmr_replay.jobs.pair_owner import Compared as OneOfPair
from wmr_replay.jobs.replay import Progress
from wmr_replay.regress.logs import find_logs
from wmr_replay.regress.replayed import Asked, replay
from wmr_replay.regress.results import Results, read_results, stems
from wmr_replay.regress.sides import Comparison as Differences
from wmr_replay.regress.sides import compare_sides, matched
from wmr_replay.report.bundle import check_extra
from wmr_replay.report.compare import Compared as TwoResults
from wmr_replay.report.compare import compare_page
from wmr_replay.timeline.comparison import Side as TimelineSide
from wmr_replay.timeline.comparison import comparison_text, write_comparison
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import check_writable, made_folder, whole_file, whole_files
from wmr_schemas.text import figure, json_text, shown

Compared: TypeAlias = LocalPlace | Result
"""A directory of results, a log or a directory of logs, or a result in memory."""
Watch = Callable[[str], AbstractContextManager[Progress | None]]
"""Given the name of a log, a context that yields the progress callback of its replay."""


@dataclass(frozen=True, eq=False)
class Side:
    """Where one side's tables come from: ``results()`` reads, replays or hands them out.

    ``sha256()`` is the hash of its log, where it is known.
    """

    stem: str
    path: str
    name: str
    results: Callable[[], Results]
    sha256: Callable[[], str | None]

    @property
    def compared(self) -> OneOfPair:
        """The same as the owner of files."""
        return OneOfPair(self.name, self.sha256)


class Comparison:
    """The answer of ``compare``: what differs between the results a and b.

    Attributes:
        stem: Name of a's log without its ending; files are named after it.
        a: What a is, in words.
        b: What b is, in words.
        files: The files that were written, by kind; empty before ``save``.
    """

    def __init__(self, stem: str, a: str, b: str, sides: tuple[Results, Results]) -> None:
        self.stem, self.a, self.b = stem, a, b
        self.files: dict[str, Path] = {}
        self._sides, self._differences = sides, compare_sides(*sides)

    @property
    def differences(self) -> Differences:
        """Counts of rows, and the tables below in one object."""
        return self._differences

    @property
    def summary(self) -> pl.DataFrame:
        """Fields of the summary that differ: ``field, a, b, delta``."""
        return self._differences.summary

    @property
    def columns(self) -> pl.DataFrame:
        """Difference b − a of each column of the samples: ``column, n, max, at_s, rms``."""
        return self._differences.columns

    @property
    def log_sha256(self) -> dict[str, str | None]:
        """Hashes of the two logs, by ``a`` and ``b``."""
        return {side: sha256_in(results) for side, results in zip("ab", self._sides, strict=True)}

    @property
    def other_mode_share(self) -> float | None:
        """Share of the common rows with another mode; None without any."""
        return self._differences.other_mode_share

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"a": self.a, "b": self.b, "log_sha256": self.log_sha256, **self._differences.as_dict()}

    def told(self) -> list[str]:
        """How many rows were compared and how, and a warning where the two are no single drive."""
        found, share = self._differences, self._differences.other_mode_share
        matched = "" if found.by_stamp else ", matched by the time since the start"
        lines = [f"{found.n_a} and {found.n_b} rows, {found.n_common} in common{matched}"]
        if found.unrelated:
            lines.append(f"warning: a and b look like two different drives: {found.unrelated}")
        return [*lines, "no row in common" if share is None else f"another mode in {share:.2%} of them"]

    def lines(self) -> list[str]:
        """The differences as text."""
        found = self._differences
        share = found.other_mode_share
        lines = [f"a  {shown(self.a)}", f"b  {shown(self.b)}", "", *self.told()]
        rows = found.summary.iter_rows(named=True)
        cells = [(r["field"], *map(figure, (r["a"], r["b"])), figure(r["delta"], sign="+")) for r in rows]
        if cells:
            lines += ["", *text_table(("summary", "a", "b", "b − a"), cells)]
        changed = found.columns.filter(found.columns["rms"] > 0)
        rows = changed.iter_rows(named=True)
        cells = [
            (r["column"], figure(r["max"], sign="+"), f"{r['at_s']:.3f}", figure(r["rms"])) for r in rows
        ]
        if cells:
            lines += ["", *text_table(("samples", "largest", "at s", "rms"), cells)]
        return lines if len(found.summary) or len(changed) or share else [*lines, "no difference"]

    def timeline(self, path: LocalPlace) -> Path | None:
        """Write both sides into one Rerun recording; None, and no file, where a side has no row."""
        if not (self._differences.n_a and self._differences.n_b):
            return None
        target = local_path(path)
        home_of(target)
        a, b = (
            TimelineSide(name, results.samples, results.summary["rate_hz"][0] or 1.0)
            for name, results in zip((self.a, self.b), self._sides, strict=True)
        )
        found = self._differences
        text = comparison_text(a.name, b.name, self.told(), self.summary)
        write_comparison(target, a, b, found.other_mode, text, by_stamp=found.by_stamp)
        return target

    def report(self, path: LocalPlace) -> Path:
        """Write the report to ``path`` (``.html``): one file to mail, with everything inside.

        Raises MissingExtra without the extra ``report``.
        """
        target = local_path(path)
        home_of(target)
        a, b = (results.samples for results in self._sides)
        joined, by_stamp = matched(a, b)
        two = TwoResults(self.a, self.b, a, b, joined, by_stamp, self.summary, self.columns)
        text = compare_page(two, self.stem)
        with whole_file(target) as part:
            part.write_text(text, encoding="utf-8")
        return target

    def save(
        self, directory: LocalPlace, *, timeline: bool = True, report: bool = False, force: bool = False
    ) -> dict[str, Path]:
        """Write ``<stem>.compare.json``, ``.compare.rrd`` and, if asked for, ``.compare.html``; the files by
        kind.

        They appear together or not at all; what is not asked for is removed. The comparison of another pair
        is replaced with ``force`` alone. Raises InvalidSetting without.
        """
        if report:
            check_extra()
        hashes = self.log_sha256
        a, b = (OneOfPair(n, partial(hashes.get, s)) for n, s in zip((self.a, self.b), "ab", strict=True))
        claim = PairClaim(local_path(directory), self.stem, a, b)
        claim.check(force=force)
        drawn = timeline and self._differences.n_a and self._differences.n_b
        asked = ("json", *(["timeline"] if drawn else []), *(["report"] if report else []))
        self.files = {kind: claim.file(kind) for kind in asked}
        with made_folder(claim.directory), whole_files(self.files) as parts:
            parts["json"].write_text(json_text(self.as_dict()) + "\n", encoding="utf-8")
            if drawn:
                self.timeline(parts["timeline"])
            if report:
                self.report(parts["report"])
        for kind in ENDINGS.keys() - set(asked):
            claim.file(kind).unlink(missing_ok=True)
        return self.files

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return shown(f"<Comparison of {self.a} and {self.b}>")


def compare(
    a: Compared,
    b: Compared | None = None,
    *,
    settings_a: SettingsArguments | None = None,
    settings_b: SettingsArguments | None = None,
) -> Comparison:
    """Show what differs between two results, two logs, or one log with two settings.

    Args:
        a: A result, a directory with the results of one log, or a log, which is replayed.
        b: The other one; None: ``a`` again, with other settings.
        settings_a: Settings of a's replay.
        settings_b: Settings of b's replay.

    Raises:
        InvalidSetting: Nothing to compare with, settings for results that are stored already, or directories
            of several logs: ``compare_all`` takes these.
    """
    pairs, _ = pairs_of(a, b, settings_a or {}, settings_b or {})
    if len(pairs) != 1:
        raise InvalidSetting(f"{len(pairs)} pairs of results; wmr_replay.compare_all compares several")
    return compare_pair(*pairs[0])


def compare_all(
    a: Compared,
    b: Compared | None = None,
    *,
    settings_a: SettingsArguments | None = None,
    settings_b: SettingsArguments | None = None,
    out: LocalPlace | None = None,
    timeline: bool = True,
    report: bool = False,
    force: bool = False,
    watch: Watch | None = None,
) -> tuple[list[Comparison], list[str]]:
    """The same for directories of several results or logs, which are paired by name.

    Returns the comparisons, and the names that are on one side only. Raises as ``compare`` does.

    Args:
        a: As for ``compare``, or a directory of several results or logs.
        b: The other one.
        settings_a: Settings of a's replays.
        settings_b: Settings of b's replays.
        out: Directory for the files; None: nothing is written.
        timeline: Whether ``out`` receives Rerun timelines too.
        report: Whether ``out`` receives reports too (extra ``report``).
        force: Replace the comparison of another pair of the same name in ``out``.
        watch: Called with the name of each log that is replayed.
    """
    pairs, lonely = pairs_of(a, b, settings_a or {}, settings_b or {}, watch)
    if out is None:
        return [compare_pair(*pair) for pair in pairs], lonely
    if report:
        check_extra()
    directory = local_path(out)
    check_writable(directory)
    for first, second in pairs:
        PairClaim(directory, first.stem, first.compared, second.compared).check(force=force)
    comparisons = [compare_pair(*pair) for pair in pairs]
    for comparison in comparisons:
        comparison.save(directory, timeline=timeline, report=report, force=force)
    return comparisons, lonely


def compare_pair(a: Side, b: Side) -> Comparison:
    """One pair."""
    return Comparison(a.stem, a.name, b.name, (a.results(), b.results()))


def pairs_of(
    a: Compared,
    b: Compared | None,
    settings_a: Mapping[str, Any],
    settings_b: Mapping[str, Any],
    watch: Watch | None = None,
) -> tuple[list[tuple[Side, Side]], list[str]]:
    """One with one whatever their names, else those of one name; and the names without a partner."""
    if b is None and settings_a == settings_b:
        raise InvalidSetting("compare with what? Name another result or log, or another setting")
    first, second = sides_of(a, settings_a, watch), sides_of(a if b is None else b, settings_b, watch)
    if len(first) == len(second) == 1:
        return [(first[0], second[0])], []
    others = {side.stem: side for side in second}
    pairs = [(side, others[side.stem]) for side in first if side.stem in others]
    if not pairs:
        raise InvalidSetting(f"{first[0].path} and {second[0].path} have no name in common")
    return pairs, sorted({side.stem for side in first} ^ set(others))


def sides_of(given: Compared, settings: Mapping[str, Any], watch: Watch | None) -> list[Side]:
    """The results or logs at a place. Raises InvalidSetting for settings of a result that is there."""
    if isinstance(given, Result):
        refuse_settings(given.stem, settings)
        return [Side(given.stem, given.stem, given.stem, lambda: tables_of(given), lambda: sha256_in(given))]
    path = local_path(given)
    stored = stems(path) if path.is_dir() else []
    if stored:
        refuse_settings(str(path), settings)
        return [stored_side(path, stem) for stem in stored]
    settings_of(settings)
    return [replayed_side(log, settings, watch) for log in find_logs([path])]


def refuse_settings(name: str, settings: Mapping[str, Any]) -> None:
    """Raises InvalidSetting where there are any."""
    if settings:
        raise InvalidSetting(f"{name} holds results; settings are for logs, which are replayed with them")


def stored_side(directory: Path, stem: str) -> Side:
    """Stored results of one log."""
    results = partial(read_results, directory, stem)
    return Side(stem, str(directory), f"{directory}/{stem}", results, lambda: sha256_in(results()))


def replayed_side(log: Path, settings: Mapping[str, Any], watch: Watch | None) -> Side:
    """A log, replayed with these settings."""
    changes = " ".join(f"{key}={value}" for key, value in settings.items())

    def replayed() -> Results:
        with nullcontext() if watch is None else watch(log.name) as progress:
            return replay(log, Asked().changed(untuned(settings)), progress)

    return Side(log.stem, str(log), f"{log} {changes}".strip(), replayed, lambda: sha256_of(log))


def sha256_in(results: Results | Result) -> str | None:
    """The hash of the log that results were made of."""
    found = results.summary["log_sha256"][0] if "log_sha256" in results.summary.columns else None
    return None if found is None else str(found)


def tables_of(result: Result) -> Results:
    """A result's tables as they are on disk."""
    parts: Sequence[pl.DataFrame] = list(result.stored_batches())
    return Results(pl.concat(parts), result.stored_segments, result.summary)


def text_table(headings: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Lines of a table as narrow as its cells: names to the left, figures to the right."""
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    return [
        "  ".join([f"{row[0]:{widths[0]}}", *(f"{c:>{w}}" for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in (headings, *rows)
    ]
