"""Where simulation and measurement of a log disagree, and what the model lacks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import polars as pl

from wmr_replay.api.places import LocalPlace, Place, home_of, local_path, places_of
from wmr_replay.api.request import (
    Instant,
    MappingLike,
    ModelLike,
    between_of,
    mapping_of,
    model_of,
    settings_of,
)
from wmr_replay.gap import GapResult
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.early_import import GAP_TIMELINE, import_early
from wmr_replay.jobs.gap import GapRun, write_gap
from wmr_replay.jobs.gap_asked import MOST_ON_TORQUES, Asked, check_base, check_base_kept, options_of
from wmr_replay.jobs.gap_traces import traces_frame
from wmr_replay.jobs.owner import Claim
from wmr_replay.jobs.wheel_speed import Request
from wmr_replay.report.bundle import check_extra
from wmr_replay.report.gap import gap_page
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.gap_file import GapFile, gap_to_json
from wmr_schemas.model_file import Model
from wmr_schemas.signals import Log
from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.plots.figure import Figure

ASIDE = "wheel-speed"
"""Directory of the analysis on wheel speeds beside one on torques."""
EFFECT_COLUMNS = {
    "effect": pl.String,
    "parameter": pl.String,
    "value": pl.Float64,
    "ci95_low": pl.Float64,
    "ci95_high": pl.Float64,
    "unit": pl.String,
    "p_value": pl.Float64,
}


class Gap:
    """The answer of ``gap``.

    Attributes:
        document: The contents of ``gap.json``.
        result: The analysis with all its traces.
        log: The signals that were analysed.
        files: The files that were written, by kind; empty without ``out``.
        also: With ``base="both"`` the analysis on wheel speeds beside this one on torques.
    """

    def __init__(
        self, run: GapRun, files: Mapping[str, Path] | None = None, also: "Gap | None" = None
    ) -> None:
        self._run, self.files, self.also = run, dict(files or {}), also

    @property
    def document(self) -> GapFile:
        """The contents of ``gap.json``."""
        return self._run.document

    @property
    def result(self) -> GapResult:
        """The analysis with all its traces."""
        return self._run.result

    @property
    def log(self) -> Log:
        """The signals that were analysed."""
        return self._run.log

    @property
    def verdict(self) -> str:
        """``named``, ``ambiguous``, ``unnamed``, ``nothing_missing`` or ``not_enough_excitation``."""
        return self.document.verdict

    @property
    def sentence(self) -> str:
        """The verdict in a sentence."""
        return self.document.sentence.strip()

    @property
    def findings(self) -> tuple[dict[str, Any], ...]:
        """What is wrong with the data: code, severity, text, meaning, advice, n, where."""
        return tuple(msgspec.to_builtins(found) for found in self.document.findings)

    @property
    def model(self) -> Model:
        """The base model extended by the effects that were found."""
        return self.result.model

    @property
    def effects(self) -> pl.DataFrame:
        """One row per parameter of the missing effects: value, 95 % interval, unit, p value."""
        rows = [
            (effect.name, name, p.value, *p.ci95, p.unit, effect.p_value)
            for effect in self.document.effects
            for name, p in effect.parameters.items()
        ]
        return pl.DataFrame(rows, schema=EFFECT_COLUMNS, orient="row")

    def as_json(self) -> str:
        """``gap.json``."""
        return gap_to_json(self.document)

    @property
    def traces(self) -> pl.DataFrame:
        """Residuals, paths and errors over time, as ``gap_traces.parquet`` holds them."""
        return traces_frame(self.result.traces)

    def save(self, directory: LocalPlace, *, timeline: bool = True, report: bool = False) -> dict[str, Path]:
        """Write the files that ``wmr-replay gap --out DIRECTORY`` writes; the files by kind."""
        return write_gap(self._run, local_path(directory), timeline=timeline, report=report)

    def report(self, path: LocalPlace) -> Path:
        """Write the report to ``path`` (``.html``): one file to mail, with everything inside.

        Raises MissingExtra without the extra ``report``.
        """
        target = local_path(path)
        home_of(target)
        text = gap_page(self.document, self.traces, self._run.path.name, self._run.proof)
        with whole_file(target) as part:
            part.write_text(text, encoding="utf-8")
        return target

    def plot(self) -> "Figure":
        """Residuals, paths by error and gaps as a matplotlib figure (extra ``plot``)."""
        from wmr_replay.api.plots import gap_figure  # noqa: PLC0415 – an extra

        return gap_figure(self.document, self.traces)

    def __repr__(self) -> str:
        return shown(f"<Gap of {self.document.log}: {self.verdict}: {self.sentence}>")


def gap(
    log: Place | Sequence[Place],
    out: LocalPlace | None = None,
    *,
    model: ModelLike | None = None,
    base_log: Place | None = None,
    prove_on: Place | None = None,
    base: str = "auto",
    inputs: str = "measured",
    modes: str = "identified",
    tolerance_m: float = 0.003,
    tolerance_s: float = 4.0,
    max_effects: int | None = None,
    seed: int = 0,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    clock_offset_s: float = 0.0,
    timeline: bool = True,
    report: bool = False,
    command: str = "",
    force: bool = False,
    progress: Progress | None = None,
) -> Gap:
    """Say where simulation and measurement of a log disagree, and what the model lacks.

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL; several logs of one
            robot where wheel speeds drive the model.
        out: Directory for the result files; None: nothing is written.
        model: Base model or model file; None: the log's own parameters, else calibrated on the log.
        base_log: In place of a model, the log of a simulator: what it shows is the base model.
        prove_on: Another log of the robot, of which nothing is fitted: base and extended model are simulated
            on it, too.
        base: What drives the base model: ``torque``, ``wheel-speed``, ``both``, or ``auto``: torques where
            the log has them, else wheel speeds.
        inputs: Of wheel speeds: ``measured``, or the ``commands``.
        modes: Contact modes: ``identified``, ``ideal`` throughout, or ``topic:T`` for those on topic T.
        tolerance_m: An effect counts when it moves the simulated path by more than this …
        tolerance_s: … within this time.
        max_effects: Most effects looked for; None: 3 on torques, 8 on wheel speeds.
        seed: Seed of the placebo logs.
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        clock_offset_s: Added to the stamps of torques and wheel speeds.
        timeline: Whether ``out`` receives a Rerun timeline too.
        report: Whether ``out`` receives a report too, one HTML file (extra ``report``).
        command: What the extended model states as its origin.
        force: Replace results of another log of the same name in ``out``.
        progress: Called with what is being done and the share that is done.

    Raises:
        LogUnusable: No pose, neither torques nor wheel speeds, a log that is too short, or data whose
            findings bar an answer.
        InvalidSetting: An option that makes no sense, or ``out`` holds results of another log.
    """
    if report:
        check_extra()
    check_base(base, inputs)
    if model is not None and base_log is not None:
        raise InvalidSetting("the base is a model or a simulator's log, not both")
    places = places_of(log)
    place, directory = places[0], None if out is None else local_path(out)
    options, topic = options_of(modes, tolerance_m, tolerance_s, max_effects or MOST_ON_TORQUES, seed)
    if directory is not None and model is not None and not isinstance(model, Model):
        check_base_kept(place, directory, local_path(model))
    claim = None if directory is None else Claim.of(directory, place, models=True)
    replaces = claim is not None and claim.settled(force=force)
    if claim is not None and timeline:
        import_early(GAP_TIMELINE)
    asked = Asked(
        places,
        model_of(model),
        options,
        topic,
        Request(
            mapping_of(mapping),
            between_of(start, end),
            settings_of({"clock_offset_s": clock_offset_s}).clock_offset_s,
            commands=inputs == "commands",
        ),
        max_effects,
        command,
        progress,
        None if base_log is None else places_of(base_log)[0],
        None if prove_on is None else places_of(prove_on)[0],
    )
    runs = asked.runs(base)
    if claim is None:
        return Gap(runs[0], also=Gap(runs[1]) if len(runs) > 1 else None)
    return written(runs, claim, timeline=timeline, report=report, replaces=replaces)


def written(runs: list[GapRun], claim: Claim, *, timeline: bool, report: bool, replaces: bool) -> Gap:
    """The answer with its files; that of a second base stands in a directory of its own. ``replaces`` says
    that another log's results go.
    """
    files = write_gap(runs[0], claim.directory, timeline=timeline, report=report)
    also = None
    if len(runs) > 1:
        aside = write_gap(runs[1], claim.directory / ASIDE, timeline=timeline, report=report)
        also = Gap(runs[1], aside)
    if replaces:
        claim.remove_others(files.values())
    return Gap(runs[0], files, also)
