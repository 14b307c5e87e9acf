"""Parameters and noise together: Gauss–Newton on whitened errors, noise by maximum likelihood in turns."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.wheel_speed.bins import Bins
from wmr_replay.gap.wheel_speed.candidates import STAMPED
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.noise import Noise, Whitening, deviance, fit_noise, weights_of
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, replaced
from wmr_schemas.arrays import F64, I64, Bool

LATE_POSE = "pose_delay"
FORM_SD = {
    "lateral_slip": 0.06,
    "turning_slip": 0.03,
    "slip_ratio": 0.05,
    "acceleration_limit": 0.005,
    "turn_acceleration_limit": 0.005,
}
"""Standard deviation of a size, as a share of it, by the form that is not known: a tyre's slip builds up over
a relaxation length, contacts are elastic, a drive takes commands in steps of its own. Encoder benchmark,
develop families.
"""
Noises = tuple[Noise, Noise, Noise]


class White(NamedTuple):
    """Whitened and weighted rows that are fitted: ``errors`` (m,), ``columns`` (m, p), ``cluster`` (m,)."""

    errors: F64
    columns: F64
    cluster: I64


@dataclass(frozen=True, eq=False)
class Fit:
    """Values of the parameters, the noise, −2 log likelihood, information (p, p), robust covariance (p, p),
    and the number of clusters behind it; ``stamps_s`` is the sd of the instant within a step of the wheels'
    speeds to which their stamp belongs.
    """

    parameters: tuple[Parameter, ...]
    values: Values
    noises: Noises
    minus_two_log: float
    information: F64
    covariance: F64
    n_clusters: int
    stamps_s: float = 0.0

    @property
    def sizes(self) -> F64:
        """The parameters' values (p,)."""
        return np.array([self.values[one.effect][one.key] for one in self.parameters])

    @property
    def sd(self) -> F64:
        """Standard deviations (p,): those of :attr:`spread`, and of a late pose what stamps leave open."""
        late = np.array([one.effect == LATE_POSE for one in self.parameters])
        return np.asarray(np.sqrt(np.diag(self.spread) + late * self.stamps_s**2))

    @property
    def spread(self) -> F64:
        """The covariance (p, p) that tests and intervals use: robust, but never below the likelihood's, and
        with what stamps and unknown forms leave open. A pose that is late by less than a step is late all the
        same: without it, another effect would explain that.
        """
        of_stamps = [one.effect in STAMPED and one.effect != LATE_POSE for one in self.parameters]
        stamps = self.stamps_s**2 * np.array(of_stamps)
        forms = np.array([FORM_SD.get(one.effect, 0.0) for one in self.parameters])
        own = inverse(self.information)
        grown = np.maximum(np.diag(self.covariance), np.diag(own)) / np.maximum(
            np.diag(self.covariance), 1e-300
        )
        scale = np.sqrt(grown)
        open_to = np.diag(stamps + (forms * self.sizes) ** 2)
        return np.asarray(self.covariance * np.outer(scale, scale) + open_to)


def fit(
    problem: Problem, parameters: tuple[Parameter, ...], start: Values, noises: Noises | None = None
) -> Fit:
    """The best values of ``parameters`` from ``start`` on; ``noises`` where given are the first guess."""
    own, values = problem.settings.fit, start
    for number in range(own.rounds):
        noises = fit_noises(problem, values, noises)
        values, moved = gauss_newton(problem, parameters, values, noises, robustly=number > 0)
        if number and not moved:
            break
    assert noises is not None
    return at(problem, parameters, values, noises)


def refit(problem: Problem, parameters: tuple[Parameter, ...], start: Values, noises: Noises) -> Fit:
    """The best values of ``parameters`` at a given noise."""
    values, _ = gauss_newton(problem, parameters, start, noises, robustly=True)
    return at(problem, parameters, values, noises)


def at(problem: Problem, parameters: tuple[Parameter, ...], values: Values, noises: Noises) -> Fit:
    """The likelihood, information and robust covariance at given values."""
    white = whitened(problem, parameters, values, noises)
    information = white.columns.T @ white.columns
    covariance, n_clusters = robust(white, information)
    return Fit(
        parameters,
        values,
        noises,
        minus_two_log(problem, values, noises),
        information,
        covariance,
        n_clusters,
        problem.record.wheel_step_s / np.sqrt(12),
    )


def gauss_newton(
    problem: Problem, parameters: tuple[Parameter, ...], values: Values, noises: Noises, *, robustly: bool
) -> tuple[Values, bool]:
    """Values after up to ``steps`` steps, and whether they moved.

    A step that does not lower the deviance is halved. The columns of measured wheel speeds hardly change, and
    are those of the first step. Unless ``robustly``, no error is clipped.
    """
    own, moved = problem.settings.fit, False
    if not parameters:
        return values, False
    view = View.of(problem, noises, robustly=robustly)
    errors, columns = view.errors(values), view.columns(values, parameters)
    for number in range(own.steps):
        if number and problem.record.driven_by == "command":
            columns = view.columns(values, parameters)
        white = view.rows(errors, columns)
        cov = inverse(white.columns.T @ white.columns)
        step = cov @ (white.columns.T @ white.errors)
        taken = lower(view, parameters, values, step, view.deviance(errors))
        if taken is None:
            break
        values, errors, share = taken
        moved = True
        if np.all(share * np.abs(step) <= own.converged_sd * np.sqrt(np.maximum(np.diag(cov), 1e-300))):
            break
    return values, moved


def lower(
    view: "View", parameters: tuple[Parameter, ...], values: Values, step: F64, before: float
) -> tuple[Values, F64, float] | None:
    """Values after the largest share of ``step`` that lowers the deviance, their errors and the share."""
    for share in (1.0, 0.4, 0.1, 0.02):
        tried = values
        for which, change in zip(parameters, share * step, strict=True):
            low, high = which.bounds
            value = float(np.clip(values[which.effect][which.key] + change, low, high))
            tried = replaced(tried, which, value)
        errors = view.errors(tried)
        if view.deviance(errors) < before:
            return tried, errors, share
    return None


@dataclass(frozen=True, eq=False)
class View:
    """The fitted blocks of a problem, and the whitening of each channel."""

    problem: Problem
    chosen: Bool
    bins: Bins
    whitening: tuple[Whitening, ...]
    clip: float
    reject: float

    @classmethod
    def of(cls, problem: Problem, noises: Noises, *, robustly: bool = True) -> "View":
        """The fitted blocks at ``noises``."""
        own = problem.settings.fit
        limits = (own.clip, own.reject) if robustly else (np.inf, np.inf)
        chosen = fitted_blocks(problem)
        bins = replace(problem.bins, table=problem.bins.table[chosen])
        return cls(problem, chosen, bins, tuple(Whitening.of(noise, bins) for noise in noises), *limits)

    def white(self, blocks: F64) -> F64:
        """Whitened (3, …, K', B) of blocks (3, …, K, B) of all."""
        return np.stack(
            [w(part[..., self.chosen, :], self.bins) for w, part in zip(self.whitening, blocks, strict=True)]
        )

    def errors(self, values: Values) -> F64:
        """Whitened errors (3, K', B)."""
        return self.white(self.problem.errors(values))

    def columns(self, values: Values, parameters: tuple[Parameter, ...]) -> F64:
        """Whitened columns (3, p, K', B)."""
        shape = (3, 0, len(self.bins.table), self.bins.table.shape[1])
        if not parameters:
            return np.empty(shape)
        return self.white(np.stack([self.problem.column(values, one) for one in parameters], axis=1))

    def deviance(self, errors: F64) -> float:
        """−log likelihood of whitened errors, without the determinant."""
        return float(deviance(errors, self.clip, self.reject).sum())

    def rows(self, errors: F64, columns: F64) -> White:
        """Weighted rows of whitened errors (3, K', B) and columns (3, p, K', B)."""
        root = np.sqrt(weights_of(errors, self.clip, self.reject))
        inside = self.bins.inside
        flat = (root[:, None] * columns)[:, :, inside]
        return White(
            (root * errors)[:, inside].ravel(),
            flat.transpose(0, 2, 1).reshape(3 * int(inside.sum()), columns.shape[1]),
            np.tile(clusters(self.problem, self.bins), 3),
        )


def fit_noises(problem: Problem, values: Values, start: Noises | None = None) -> Noises:
    """The noise of each channel on the fitted blocks."""
    chosen = fitted_blocks(problem)
    bins = replace(problem.bins, table=problem.bins.table[chosen])
    errors = problem.errors(values)[:, chosen]
    found = [
        fit_noise(errors[c], bins, problem.settings.fit, None if start is None else start[c])
        for c in range(3)
    ]
    return found[0], found[1], found[2]


def whitened(problem: Problem, parameters: tuple[Parameter, ...], values: Values, noises: Noises) -> White:
    """Errors and columns of the fitted blocks, whitened, weighted and in one row."""
    view = View.of(problem, noises)
    return view.rows(view.errors(values), view.columns(values, parameters))


def clusters(problem: Problem, bins: Bins) -> I64:
    """Cluster of each bin inside the blocks: parts of ``cluster_s`` of one block."""
    size = max(1, round(problem.settings.fit.cluster_s / bins.step_s))
    block, place = np.nonzero(bins.inside)
    parts = bins.table.shape[1] // size + 1
    _, number = np.unique(block * parts + place // size, return_inverse=True)
    return np.asarray(number)


def robust(white: White, information: F64) -> tuple[F64, int]:
    """Covariance that holds where errors within a cluster are correlated, and the number of clusters."""
    n = int(white.cluster.max(initial=-1)) + 1
    p = white.columns.shape[1]
    if not p:
        return np.empty((0, 0)), n
    scores = np.zeros((n, p))
    np.add.at(scores, white.cluster, white.columns * white.errors[:, None])
    half = inverse(information)
    grown = n / max(n - p, 1)
    return np.asarray(half @ (scores.T @ scores) @ half * grown), n


def minus_two_log(problem: Problem, values: Values, noises: Noises) -> float:
    """−2 log likelihood of the fitted blocks, Huber's."""
    return 2 * float(block_deviance(problem, values, noises)[fitted_blocks(problem)].sum())


def block_deviance(problem: Problem, values: Values, noises: Noises) -> F64:
    """−log likelihood of each block (K,)."""
    errors, bins, own = problem.errors(values), problem.bins, problem.settings.fit
    total = np.zeros(len(bins.table))
    for c, noise in enumerate(noises):
        whitening = Whitening.of(noise, bins)
        total += deviance(whitening(errors[c], bins), own.clip, own.reject).sum(axis=1)
        total += bins.inside[:, 1:] @ np.log(np.diag(whitening.factor))[1:]
    return total


def fitted_blocks(problem: Problem) -> Bool:
    """Which blocks (K,) are fitted."""
    return np.asarray(problem.fitted[problem.bins.table[:, 0]])


def inverse(information: F64) -> F64:
    """Inverse of an information matrix; directions without information get a large variance."""
    if not len(information):
        return information
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(scaled, rcond=1e-9, hermitian=True) / np.outer(scale, scale))
