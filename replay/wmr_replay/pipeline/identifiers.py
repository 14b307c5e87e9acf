"""The identifier that the settings name, and its verdicts as rows of the table."""

from collections.abc import Iterable

import numpy as np

from wmr_replay.identify import Identifier, PaperIdentifier, Rules, Verdict, make_rules
from wmr_replay.identify.algebraic import AlgebraicIdentifier, AlgebraicSettings
from wmr_replay.identify.filter_bank import BankIdentifier, BankSettings
from wmr_replay.identify.joint_bank import JointBankIdentifier
from wmr_replay.identify.thresholds.wheel_speeds import WheelThresholds
from wmr_replay.identify.undecided import Undecided
from wmr_replay.identify.wheel_bank import WheelBankIdentifier
from wmr_replay.identify.wheel_bank.states import PARAMETER_OF
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import (
    JOINT_BANK,
    NO_IDENTIFIER,
    SKIDS_ALONE,
    WHEEL_BANK,
    WHEEL_THRESHOLDS,
    Settings,
)
from wmr_schemas.arrays import I8, NS_PER_S, Bool
from wmr_schemas.model_file import Effect
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.status import Status

BANKS = (BankIdentifier, WheelBankIdentifier, JointBankIdentifier)


def make_identifier(settings: Settings, model: ReplayModel, *, window_s: float, step_s: float) -> Identifier:
    """The identifier ``settings.identifier`` for the robot and the effects of ``model``.

    ``window_s`` is the window of the first differentiator. The regression of α takes rows that far apart:
    twice the delay, so that nine tenths of a longer, tuned window lie within it as well.
    """
    rules = make_rules(
        model.robot,
        window_ns=round(window_s * NS_PER_S),
        threshold_sd=settings.threshold_sd,
        min_c_k_mps=settings.min_c_k_mps,
        min_c_d_mps2=settings.min_c_d_mps2,
        min_sideslip=settings.min_sideslip_of(model.robot),
    )
    if settings.identifier == NO_IDENTIFIER:
        return Undecided()
    if settings.identifier in ("paper", SKIDS_ALONE):
        return PaperIdentifier(rules)
    if settings.identifier == "algebraic":
        algebraic = AlgebraicSettings(settings.min_confidence)
        return AlgebraicIdentifier(model.robot, rules, algebraic, terms=model.terms)
    return make_bank(settings, model, rules, step_s)


def make_bank(settings: Settings, model: ReplayModel, rules: Rules, step_s: float) -> Identifier:
    """What tells modes by wheel speeds, or the bank of the settings."""
    if settings.identifier == WHEEL_THRESHOLDS:
        return WheelThresholds(model.robot, rules, known_of_wheels(model.effects))
    bank = BankSettings(min_confidence=settings.min_confidence)
    if settings.identifier == WHEEL_BANK:
        return WheelBankIdentifier(model.robot, rules, step_s, bank, known_of_wheels(model.effects))
    if settings.identifier == JOINT_BANK:
        return JointBankIdentifier(model.robot, rules, step_s, bank, known_of_wheels(model.effects))
    return BankIdentifier(model.robot, rules, step_s, bank, both=settings.simultaneous, terms=model.terms)


def known_of_wheels(effects: Iterable[Effect]) -> dict[str, tuple[float, float]]:
    """What a model's effects say of a robot with wheel speeds: size and standard deviation by name."""
    return {
        effect.name: (value, effect.sd.get(parameter, 0.0))
        for effect in effects
        if effect.name in PARAMETER_OF
        for parameter, value in effect.parameters.items()
    }


def follow_rate(identifier: Identifier, step_s: float) -> None:
    """The pose comes every ``step_s`` from now on; only the banks count rows."""
    if isinstance(identifier, BANKS):
        identifier.change_rate(step_s)


def undecided_while_filling(verdict: Verdict, filling: Bool, all_modes: ModeSet) -> Verdict:
    """Rows of the mask ``filling`` get no verdict: the differentiator's window is not full there."""
    if not filling.any():
        return verdict
    return verdict._replace(
        posterior=np.where(filling, np.nan, verdict.posterior),
        wheels=None if verdict.wheels is None else verdict.wheels.without(filling),
        mode=np.where(filling, ContactMode.UNDECIDED, verdict.mode).astype(np.int8),
        mode_set=np.where(filling, all_modes, verdict.mode_set).astype(np.uint8),
        outcome=np.where(filling, Status.WARMING_UP, verdict.outcome).astype(np.int8),
    )


def undecided_where_barred(verdict: Verdict, barred: I8, all_modes: ModeSet) -> Verdict:
    """Rows whose ``barred`` (n,) is not ``OK`` get no mode, no probabilities and no α, and it as outcome; a
    window that is still filling keeps its own.
    """
    rows = (barred != Status.OK) & (verdict.outcome != Status.WARMING_UP)
    if not rows.any():
        return verdict
    return verdict._replace(
        posterior=np.where(rows, np.nan, verdict.posterior),
        alpha=np.where(rows, np.nan, verdict.alpha),
        alpha_sd=np.where(rows, np.nan, verdict.alpha_sd),
        wheels=None if verdict.wheels is None else verdict.wheels.without(rows),
        mode=np.where(rows, ContactMode.UNDECIDED, verdict.mode).astype(np.int8),
        mode_set=np.where(rows, all_modes, verdict.mode_set).astype(np.uint8),
        outcome=np.where(rows, barred, verdict.outcome).astype(np.int8),
    )
