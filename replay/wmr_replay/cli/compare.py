"""``wmr-replay compare``: two results, two logs, or one log with two settings."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.regress.results import Results
    from wmr_replay.regress.sides import Comparison


@click.command(
    "compare",
    epilog="""\b
Examples:
  wmr-replay compare before/ after/                        two directories of results
  wmr-replay compare monday.mcap tuesday.mcap              two logs
  wmr-replay compare drive.mcap --set-b identifier=paper   one log, two settings
  wmr-replay compare drive.mcap --set-a window_s=.5 --set-b window_s=1 --out windows/
""",
)
@click.argument("a", type=click.Path(path_type=Path, exists=True))
@click.argument("b", type=click.Path(path_type=Path, exists=True), required=False)
@click.option("--set-a", metavar="NAME=VALUE", multiple=True, help="A setting of A's replay; repeatable.")
@click.option("--set-b", metavar="NAME=VALUE", multiple=True, help="The same of B's.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("compare.wmr"),
    help="Directory of <name>.compare.rrd and <name>.compare.json.",
)
@click.option("--no-rrd", is_flag=True, help="Write no Rerun timeline.")
@click.option("--json", "as_json", is_flag=True, help="The differences as JSON.")
def command(
    a: Path,
    b: Path | None,
    set_a: tuple[str, ...],
    set_b: tuple[str, ...],
    out: Path,
    no_rrd: bool,
    as_json: bool,
) -> None:
    """Show what differs between A and B.

    Each is a directory of results, a log, or a directory of logs, which are replayed. Without B, A is
    compared with itself under other settings: those of summary.settings, as for `run`. Results of several
    logs are paired by name. Prints the summary's fields that differ, the share of rows with another mode, and
    the largest and root-mean-square difference of each column; both timelines go into one recording.
    """
    if b is None and set_a == set_b:
        raise click.UsageError("compare with what? Name B, or another setting: --set-b identifier=paper")
    sides = sources(a, set_a), sources(b or a, set_b)
    pairs = [Pair(first, second, out) for first, second in paired(*sides)]
    out.mkdir(parents=True, exist_ok=True)
    outcomes = [pair.compare(timeline=not no_rrd, quiet=as_json) for pair in pairs]
    if as_json:
        from wmr_replay.cli.synth_list import echo_json

        echo_json(outcomes)


@dataclass(frozen=True)
class Source:
    """Where one side's tables come from: stored results (``directory``), or a log to be replayed."""

    stem: str
    path: Path
    settings: Mapping[str, Any]
    replayed: bool

    @property
    def name(self) -> str:
        """As a person tells it from the other."""
        changes = " ".join(f"{key}={value}" for key, value in self.settings.items())
        shown = str(self.path) if self.replayed else f"{self.path}/{self.stem}"
        return f"{shown} {changes}".strip()

    def results(self) -> "Results":
        """The three tables."""
        from wmr_replay.cli.progress import byte_progress
        from wmr_replay.regress.replayed import Asked, replay
        from wmr_replay.regress.results import read_results

        if not self.replayed:
            return read_results(self.path, self.stem)
        with byte_progress(f"replaying {self.path.name}") as progress:
            return replay(self.path, Asked().changed(self.settings), progress)


def sources(path: Path, settings: Sequence[str]) -> list[Source]:
    """The results or logs at a path."""
    from wmr_replay.cli.logs import find_logs
    from wmr_replay.regress.results import stems

    stored = stems(path) if path.is_dir() else []
    if stored and settings:
        raise InvalidSetting(f"{path} holds results; settings are for logs, which are replayed with them")
    changes = dict(map(parse_setting, settings))
    if stored:
        return [Source(stem, path, {}, replayed=False) for stem in stored]
    return [Source(log.stem, log, changes, replayed=True) for log in find_logs([path])]


def parse_setting(text: str) -> tuple[str, Any]:
    """``NAME=VALUE`` of :class:`~wmr_replay.pipeline.settings.Settings`; the value as in TOML, or a word."""
    from wmr_replay.pipeline.settings import Settings

    name, equals, value = (part.strip() for part in text.partition("="))
    known = [f.name for f in fields(Settings)]
    if name not in known or not equals or not value:
        raise InvalidSetting(f"{text!r} is no NAME=VALUE of a setting; the settings are {', '.join(known)}")
    try:
        parsed = json.loads(value) if value in {"true", "false"} else float(value)
    except ValueError:
        return name, value
    return name, int(parsed) if isinstance(parsed, float) and name in WHOLE else parsed


WHOLE = ("degree", "kappa", "mu")


def paired(a: list[Source], b: list[Source]) -> list[tuple[Source, Source]]:
    """One with one whatever their names, else those of one name; what has no partner is said."""
    if len(a) == len(b) == 1:
        return [(a[0], b[0])]
    others = {source.stem: source for source in b}
    pairs = [(source, others[source.stem]) for source in a if source.stem in others]
    if not pairs:
        raise InvalidSetting(f"{a[0].path} and {b[0].path} have no name in common")
    lonely = {source.stem for source in a} ^ set(others)
    for stem in sorted(lonely):
        click.echo(f"{stem}: only on one side", err=True)
    return pairs


@dataclass(frozen=True)
class Pair:
    """Two sources to be compared, and where the files go."""

    a: Source
    b: Source
    out: Path

    def compare(self, *, timeline: bool, quiet: bool) -> dict[str, Any]:
        """Compare, write the files and, unless ``quiet``, print; the document."""
        from wmr_replay.regress.files import write_text
        from wmr_replay.regress.sides import compare_sides

        first, second = self.a.results(), self.b.results()
        comparison = compare_sides(first, second)
        document = {"a": self.a.name, "b": self.b.name, **comparison.as_dict()}
        path = self.out / f"{self.a.stem}.compare.json"
        write_text(path, json.dumps(document, indent=2, ensure_ascii=False) + "\n")
        lines = list(difference_lines(self, comparison))
        rrd = self.write_timeline(first, second, comparison, lines) if timeline else None
        if not quiet:
            from wmr_replay.timeline import viewer_command

            click.echo("\n".join(lines))
            click.echo(f"\nresults   {self.out}/")
            if rrd is not None:
                click.echo(f"viewer    {viewer_command(rrd)}")
        return document

    def write_timeline(
        self, first: "Results", second: "Results", comparison: "Comparison", lines: list[str]
    ) -> Path | None:
        """Both sides in one recording; nothing where a side has no row."""
        from wmr_replay.timeline import Side, write_comparison

        if not (comparison.n_a and comparison.n_b):
            return None
        path = self.out / f"{self.a.stem}.compare.rrd"
        a, b = (
            Side(source.name, results.samples, results.summary["rate_hz"][0] or 1.0)
            for source, results in ((self.a, first), (self.b, second))
        )
        text = "\n".join([f"**a**: {a.name}  ", f"**b**: {b.name}", "", "```", *lines[3:], "```"])
        write_comparison(path, a, b, comparison.other_mode, text)
        return path


def difference_lines(pair: Pair, comparison: "Comparison") -> list[str]:
    """The tables as text."""
    lines = [f"a  {pair.a.name}", f"b  {pair.b.name}", ""]
    share = comparison.other_mode_share
    matched = "" if comparison.by_stamp else ", matched by the time since the start"
    lines.append(f"{comparison.n_a} and {comparison.n_b} rows, {comparison.n_common} in common{matched}")
    lines.append("no row in common" if share is None else f"another mode in {share:.2%} of them")
    if len(comparison.summary):
        lines += ["", f"{'summary':28} {'a':>12} {'b':>12} {'b − a':>12}"]
        lines += [
            f"{row['field']:28} {figure(row['a']):>12} {figure(row['b']):>12} {figure(row['delta'], '+'):>12}"
            for row in comparison.summary.iter_rows(named=True)
        ]
    changed = comparison.columns.filter(comparison.columns["rms"] > 0)
    if len(changed):
        lines += ["", f"{'samples':28} {'largest':>12} {'at s':>12} {'rms':>12}"]
        lines += [
            f"{row['column']:28} {figure(row['max'], '+'):>12} {row['at_s']:12.3f} {figure(row['rms']):>12}"
            for row in changed.iter_rows(named=True)
        ]
    return lines if len(comparison.summary) or len(changed) or share else [*lines, "no difference"]


def figure(value: float | None, sign: str = "") -> str:
    """A number of four digits, or a dash."""
    return "–" if value is None else f"{value:{sign}.4g}"
