"""The joint bank as an identifier: rows go into bins, and rows report the last bin."""

import numpy as np

from wmr_replay.identify.filter_bank.bank import Bank, BankSettings
from wmr_replay.identify.filter_bank.bins import FORCE, RELEASED, Bins, into_bins, open_bin
from wmr_replay.identify.filter_bank.hindsight import LookingBack
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.independence import INDEPENDENT, NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_replay.identify.joint_bank.model import joint_model
from wmr_replay.identify.joint_bank.steps import ALPHA_ROW, N_ANSWERS
from wmr_replay.identify.posterior import BinEstimates, decide
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, Rules
from wmr_replay.identify.wheel_bank.estimates import wheel_estimates
from wmr_replay.identify.wheel_bank.identifier import N_MODES, without_torque
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import Known
from wmr_replay.identify.wheel_bank.steps import JUMPED
from wmr_schemas.robot import RobotParameters


class JointBankIdentifier:
    """Stage: evidence in, verdicts out, for a robot whose wheel speeds and torques are known.

    C_k, C_d and their thresholds come from the paper's scheme on the same rows; mode, posterior, slip and α
    from the bank, once the pose has shown that it was not integrated from the wheel speeds. Rows without
    wheel speeds get the verdict of the paper's scheme.
    """

    def __init__(
        self, robot: RobotParameters, rules: Rules, step_s: float, settings: BankSettings, known: Known
    ) -> None:
        self.settings, self._paper = settings, PaperIdentifier(rules)
        self._radius_m = robot.wheel_radius_m or WHEEL_PRIORS.unknown_radius_m
        self._bank = Bank(joint_model(robot, known), step_s, settings, N_MODES)
        self._by_wheels, self._by_efforts = open_bin(), open_bin()
        self._said = np.full(N_ANSWERS, np.nan)
        self.new_bins = Bins.none()
        """The bins that the last ``push`` completed."""

    def change_rate(self, step_s: float) -> None:
        """The pose comes every ``step_s`` from the next row on."""
        self._bank.change_rate(step_s)

    def push(self, evidence: Evidence) -> Verdict:
        """Rows in strictly increasing time; NaN until the bank has started."""
        paper = self._paper.push(evidence)
        speeds = evidence.wheels * self._radius_m
        rows = self._bank.rows_per_bin
        about = evidence.variances, evidence.restarts, rows
        by_wheels, done = into_bins(evidence.t_ns, evidence.pose, speeds, *about, self._by_wheels)
        by_efforts, _ = into_bins(evidence.t_ns, evidence.pose, evidence.efforts, *about, self._by_efforts)
        self.new_bins = both(by_wheels, by_efforts)
        found = self._bank.push(self.new_bins, paper.alpha, paper.alpha_sd, done)
        said = np.concatenate([self._said[:, None], found], axis=1)
        self._said = said[:, -1]
        alpha, second = said[ALPHA_ROW : ALPHA_ROW + 2]
        jumped = said[JUMPED] >= PRIORS.jump_probable
        answers = BinEstimates(said[:4], alpha, np.sqrt(second), jumped, done)
        independent = evidence.independence == INDEPENDENT
        known = np.isfinite(speeds[0] + speeds[1])
        independence = np.where(independent & known, evidence.independence, NOT_INDEPENDENT)
        verdict = decide(
            paper,
            evidence._replace(force=speeds[0] + speeds[1], independence=independence),
            answers,
            self.settings.min_confidence,
            N_MODES,
        )
        return verdict._replace(
            outcome=without_torque(verdict, known),
            wheels=wheel_estimates(said[:, done], speeds).without(~independent),
        )

    def looking_back(self, lag_s: float) -> LookingBack | None:
        """A second pass over the same bins with the parameters learned; None before the bank starts."""
        return self._bank.looking_back(lag_s)


def both(by_wheels: Bins, by_efforts: Bins) -> Bins:
    """The same bins with wheel speeds, and behind them with efforts."""
    efforts = by_efforts.values[FORCE:RELEASED]
    return Bins(np.concatenate([by_wheels.values, efforts]), by_wheels.stamps)
