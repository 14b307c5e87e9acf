"""A simulator as the base model: its log calibrates the model that a real log is held against.

The base is what the simulator's log shows: α, yaw gain and noise as ``fit`` gives them, and beyond them the
effects that ``gap`` finds on that log. What is then missing on the real log is missing in the simulator.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec

from wmr_replay.gap import GapOptions
from wmr_replay.ingest import LogPath
from wmr_replay.ingest.tracks import Progress
from wmr_replay.jobs.gap import FitRun, GapRun, analyse_log, calibrate_log
from wmr_replay.jobs.wheel_speed import WHEEL_SPEED, Request, analyse_wheel_logs, calibrate_wheel_logs
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.gap_file import ModelTables
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Effect, Model, effect_table, model_tables
from wmr_schemas.terms import parse_term


@dataclass(frozen=True)
class SimulatorBase:
    """The base model of a simulator's log, where the log lies, and its hash."""

    model: Model
    path: LogPath
    sha256: str


def torque_base(
    path: LogPath, mapping: LogMapping | None, options: GapOptions, progress: Progress | None
) -> SimulatorBase:
    """The base model that torques drive. Raises LogUnusable for a simulator's log that cannot be used."""
    options, known = for_simulator(options), robot_alone(mapping)
    fitted = calibrate_log(path, options=options, mapping=known, progress=progress)

    def more(base: Model) -> GapRun:
        return analyse_log(path, base=base, options=options, mapping=known, progress=progress)

    return extended(path, fitted, more)


def wheel_speed_base(
    path: LogPath, request: Request, options: GapOptions, progress: Progress | None
) -> SimulatorBase:
    """The same, where wheel speeds or commands drive the model."""
    own = Request(robot_alone(request.mapping), commands=request.commands)
    options = for_simulator(options)
    fitted = calibrate_wheel_logs([path], replace(own, commands=False), options=options, progress=progress)

    def more(base: Model) -> GapRun:
        return analyse_wheel_logs([path], own, base=base, options=options, progress=progress)

    return extended(path, fitted, more)


def for_simulator(options: GapOptions) -> GapOptions:
    """The options, with modes identified where they are those of a topic of the real log."""
    return replace(options, modes="identified") if options.modes == "given" else options


def robot_alone(mapping: LogMapping | None) -> LogMapping:
    """The mapping's robot; the simulator's topics are found by themselves."""
    return LogMapping(robot=mapping.robot if mapping else None)


def extended(path: LogPath, fitted: FitRun, more: Callable[[Model], GapRun]) -> SimulatorBase:
    """The calibrated model with the effects that the simulator's own log shows beyond it."""
    found = more(replace(fitted.model, misfit={}))  # its own rests are what the base is to hold
    kept = tuple(effect for effect in found.result.model.effects if may_be_base(effect))
    model = replace(
        fitted.model, effects=kept, misfit=fitted.model.misfit if kept == fitted.model.effects else {}
    )
    return SimulatorBase(model, path, found.sha256)


def may_be_base(effect: Effect) -> bool:
    """Whether a base model can hold the effect; it has no terms of the dictionary on the lateral channel."""
    return not effect.name.startswith(UNNAMED_PREFIX) or parse_term(effect.name).channel != "lateral"


def against(run: GapRun, base: SimulatorBase) -> GapRun:
    """The analysis with its verdict, gap.json and model saying which simulator's log it was held against."""
    result, document = run.result, run.document
    where = f"simulator's log {base.path.name}"
    said = {
        "base": where,
        "sentence": result.sentence.replace("The model lacks", "The simulator lacks", 1),
        "notes": (*result.notes, *beyond(base.model, where)),
    }
    origin = replace(
        result.model.provenance,
        base_log=str(base.path),
        base_log_sha256=base.sha256,
        base_effects=json.dumps([effect_table(effect) for effect in base.model.effects], ensure_ascii=False),
    )
    model = replace(result.model, provenance=origin)
    document = msgspec.structs.replace(
        document,
        **said,
        base_log=str(base.path),
        base_log_sha256=base.sha256,
        model=msgspec.convert(model_tables(model), ModelTables),
    )
    return replace(run, result=replace(result, model=model, **said), document=document)  # type: ignore[arg-type]


def beyond(model: Model, where: str) -> tuple[str, ...]:
    """A note on what the simulator does beyond its calibrated parameters."""
    names = ", ".join(effect.name for effect in model.effects)
    on_wheels = model.provenance.base_model == WHEEL_SPEED
    return (f"the {where} shows {names}, which the base model holds",) if names and not on_wheels else ()
