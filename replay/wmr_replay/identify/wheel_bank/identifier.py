"""The wheel-speed bank as an identifier: rows go into bins, and rows report the last bin."""

from dataclasses import replace

import numpy as np

from wmr_replay.identify.filter_bank.bank import Bank, BankSettings
from wmr_replay.identify.filter_bank.bins import Bins, into_bins, open_bin
from wmr_replay.identify.filter_bank.hindsight import LookingBack
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.independence import INDEPENDENT, NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_replay.identify.posterior import BinEstimates, decide
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules
from wmr_replay.identify.wheel_bank.estimates import wheel_estimates
from wmr_replay.identify.wheel_bank.model import wheel_model
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import Known
from wmr_replay.identify.wheel_bank.steps import JUMPED, N_ANSWERS
from wmr_schemas.arrays import I8, Bool
from wmr_schemas.modes import ModeSet
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import Status

N_MODES = 4


def without_torque(verdict: Verdict, known: Bool) -> I8:
    """The outcome of each row (n,); where wheel speeds are ``known``, torques are not what is missing."""
    turns = verdict.mode_set & int(ModeSet.SKIDDING) != 0
    reason = np.where(turns, Status.NOT_TURNING, Status.NOT_EXCITED)
    return np.where(known & (verdict.outcome == Status.NO_TORQUE), reason, verdict.outcome).astype(np.int8)


class WheelBankIdentifier:
    """Stage: evidence in, verdicts out, for a robot whose wheel speeds are known and whose torques are not.

    C_k and its threshold come from the paper's scheme on the same rows; mode and posterior from the bank,
    once the pose has shown that it was not integrated from the wheel speeds. Rows without wheel speeds get
    the verdict of the paper's scheme: skidding, or no answer.
    """

    def __init__(
        self, robot: RobotParameters, rules: Rules, step_s: float, settings: BankSettings, known: Known
    ) -> None:
        self.settings, self._paper = settings, PaperIdentifier(rules)
        self._radius_m = robot.wheel_radius_m or WHEEL_PRIORS.unknown_radius_m
        finer = replace(settings, hindsight_split_s=WHEEL_PRIORS.hindsight_split_s)
        self._bank = Bank(wheel_model(robot, known), step_s, finer, N_MODES)
        self._bin, self._said = open_bin(), np.full(N_ANSWERS, np.nan)
        self.new_bins = Bins.none()
        """The bins that the last ``push`` completed."""

    def change_rate(self, step_s: float) -> None:
        """The pose comes every ``step_s`` from the next row on."""
        self._bank.change_rate(step_s)

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time; NaN until the bank has started."""
        paper = self._paper.push(evidence)
        speeds = evidence.wheels * self._radius_m
        measured = evidence.t_ns, evidence.pose, speeds, evidence.variances, evidence.restarts
        self.new_bins, done = into_bins(*measured, self._bank.rows_per_bin, self._bin)
        found = self._bank.push(self.new_bins, paper.alpha, paper.alpha_sd, done)
        said = np.concatenate([self._said[:, None], found], axis=1)
        self._said = said[:, -1]
        unknown = np.full(said.shape[1], np.nan)
        answers = BinEstimates(said[:4], unknown, unknown, said[JUMPED] >= PRIORS.jump_probable, done)
        independent = evidence.independence == INDEPENDENT
        known = np.isfinite(speeds[0] + speeds[1])
        independence = np.where(independent & known, evidence.independence, NOT_INDEPENDENT)
        driven = evidence._replace(force=speeds[0] + speeds[1], independence=independence)
        verdict = decide(paper, driven, answers, self.settings.min_confidence, N_MODES)
        return verdict._replace(
            outcome=without_torque(verdict, known),
            wheels=wheel_estimates(said[:, done], speeds).without(~independent),
        )

    def looking_back(self, lag_s: float) -> LookingBack | None:
        """A second pass over the same bins with the parameters learned; None before the bank starts."""
        return self._bank.looking_back(lag_s)
