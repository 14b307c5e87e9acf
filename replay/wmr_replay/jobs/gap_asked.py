"""What is asked of a gap analysis: logs, base model and options; checked, then run on one base or both."""

from dataclasses import dataclass, replace
from pathlib import Path

from wmr_replay.gap import GapOptions
from wmr_replay.ingest import LogPath
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.both_bases import with_both
from wmr_replay.jobs.gap import GapRun, analyse_log
from wmr_replay.jobs.proof import Wanted, proven
from wmr_replay.jobs.simulator_base import against, torque_base, wheel_speed_base
from wmr_replay.jobs.wheel_speed import WHEEL_SPEED, Request, analyse_wheel_logs, either
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Model

BASES = ("auto", "torque", "wheel-speed", "both")
MOST_ON_TORQUES = 3
INPUTS = ("measured", "commands")
TOPIC = "topic:"
MODES = ("identified", "ideal")


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
