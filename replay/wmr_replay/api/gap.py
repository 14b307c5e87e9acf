"""Where simulation and measurement of a log disagree, and what the model lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
from wmr_replay.gap import GapOptions, GapResult
from wmr_replay.ingest import LogPath
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.both_bases import with_both
from wmr_replay.jobs.early_import import GAP_TIMELINE, import_early
from wmr_replay.jobs.gap import GapRun, analyse_log, write_gap
from wmr_replay.jobs.gap_traces import traces_frame
from wmr_replay.jobs.owner import Claim
from wmr_replay.jobs.proof import Wanted, proven
from wmr_replay.jobs.simulator_base import against, torque_base, wheel_speed_base
from wmr_replay.jobs.wheel_speed import WHEEL_SPEED, Request, analyse_wheel_logs, either
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

BASES = ("auto", "torque", "wheel-speed", "both")
MOST_ON_TORQUES = 3
INPUTS = ("measured", "commands")
ASIDE = "wheel-speed"
"""Directory of the analysis on wheel speeds beside one on torques."""
TOPIC = "topic:"
MODES = ("identified", "ideal")
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
    files = write_gap(runs[0], claim.directory, timeline=timeline, report=report)
    also = None
    if len(runs) > 1:
        aside = write_gap(runs[1], claim.directory / ASIDE, timeline=timeline, report=report)
        also = Gap(runs[1], aside)
    if replaces:
        claim.remove_others(files.values())
    return Gap(runs[0], files, also)


@dataclass(frozen=True)
class Asked:
    """An analysis that is wanted."""

    places: tuple[LogPath, ...]
    model: Model | None
    options: GapOptions
    topic: str | None
    request: Request
    max_effects: int | None
    command: str
    progress: Progress | None
    base_log: LogPath | None = None
    prove_on: LogPath | None = None

    def runs(self, base: str) -> list[GapRun]:
        """The analyses on a base; two for ``both``. Raises LogUnusable."""
        return [self.proven(run) for run in self.without_proof(base)]

    def proven(self, run: GapRun) -> GapRun:
        """The analysis with its proof on another log, where one is named."""
        if self.prove_on is None:
            return run
        request = replace(self.request, between=None)
        return proven(run, Wanted(self.prove_on, request, self.options, self.topic, self.progress))

    def without_proof(self, base: str) -> list[GapRun]:
        """The analyses alone."""
        if base == "both":
            return list(with_both(self.on_torques(), self.on_wheel_speeds()))
        if base == "wheel-speed" or (base == "auto" and self.needs_wheel_speeds()):
            return [self.on_wheel_speeds()]
        if base == "torque":
            return [self.on_torques()]
        return [either(self.on_torques, self.on_wheel_speeds)]

    def needs_wheel_speeds(self) -> bool:
        """Whether commands, several logs or the model ask for wheel speeds."""
        of_model = self.model is not None and self.model.provenance.base_model == WHEEL_SPEED
        return of_model or self.request.commands or len(self.places) > 1

    def on_torques(self) -> GapRun:
        """The analysis on torques. Raises InvalidSetting for several logs."""
        if len(self.places) > 1:
            raise InvalidSetting("torques are analysed log by log; several logs need --base wheel-speed")
        if self.max_effects is not None and self.max_effects > MOST_ON_TORQUES:
            raise InvalidSetting(f"one to three effects are looked for on torques, not {self.max_effects}")
        simulator = self.base_log and torque_base(
            self.base_log, self.request.mapping, self.options, self.progress
        )
        run = analyse_log(
            self.places[0],
            base=simulator.model if simulator else self.model,
            options=self.options,
            mode_topic=self.topic,
            mapping=self.request.mapping,
            between=self.request.between,
            clock_offset_s=self.request.clock_offset_s,
            command=self.command,
            progress=self.progress,
        )
        return against(run, simulator) if simulator else run

    def on_wheel_speeds(self) -> GapRun:
        """The analysis on wheel speeds or commands."""
        if self.topic is not None:
            raise InvalidSetting("on wheel speeds, modes are identified or ideal, not those of a topic")
        simulator = self.base_log and wheel_speed_base(
            self.base_log, self.request, self.options, self.progress
        )
        run = analyse_wheel_logs(
            self.places,
            self.request,
            base=simulator.model if simulator else self.model,
            options=self.options,
            at_most=self.max_effects,
            command=self.command,
            progress=self.progress,
        )
        return against(run, simulator) if simulator else run


def options_of(
    modes: str, tolerance_m: float = 0.003, tolerance_s: float = 4.0, max_effects: int = 3, seed: int = 0
) -> tuple[GapOptions, str | None]:
    """The options, checked, and the topic of ``topic:T``. Raises InvalidSetting."""
    topic = modes.removeprefix(TOPIC) if modes.startswith(TOPIC) else None
    if topic == "" or (topic is None and modes not in MODES):
        meant = f"; did you mean {TOPIC}{modes}?" if modes.startswith("/") else ""
        raise InvalidSetting(
            f"modes are {', '.join(MODES)}, or {TOPIC}T with the topic T of the modes; not {modes!r}{meant}"
        )
    source = modes if topic is None else "given"
    return GapOptions(source, tolerance_m, tolerance_s, max_effects, seed), topic


def check_base(base: str, inputs: str) -> None:
    """Raises InvalidSetting for an unknown base model or input, or two that do not go together."""
    if base not in BASES:
        raise InvalidSetting(f"base is one of {', '.join(BASES)}, not {base!r}")
    if inputs not in INPUTS:
        raise InvalidSetting(f"input is one of {', '.join(INPUTS)}, not {inputs!r}")
    if inputs == "commands" and base == "torque":
        raise InvalidSetting("commands drive the wheel-speed base, not the torques'")


def check_base_kept(log: LogPath, out: Path, model_file: Path) -> None:
    """Raises InvalidSetting where the extended model would take the place of the base model's file."""
    target = out / f"{log.stem}.model.toml"
    if target.exists() and model_file.exists() and target.samefile(model_file):
        raise InvalidSetting(
            f"the extended model would overwrite its base, {model_file}; choose another place with --out DIR"
        )
