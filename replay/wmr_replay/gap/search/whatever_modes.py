"""Lasting effects that a log asks for whatever its contact modes are.

An identifier that does not know an effect calls what it does slipping, and with those labels another effect
explains the rest. Here no row has a label: the likelihood of :mod:`..estimation.unknown_modes` sums over the
modes of the whole log, for every lasting effect at its likeliest size. What it shows is a model to identify
the modes with, and no answer.

The likelihood sums over modes, so that it has no innovations: its curvature in θ is that of the rows' scores,

    ∂²L/∂θ² ≈ Σ_k g_k g_kᵀ / 2,   g_k = ∂D_k/∂θ

with D_k the −2 log likelihood of row k and L its sum. Source: Berndt, Hall, Hall, Hausman, Estimation and
Inference in Nonlinear Structural Models, Annals of Economic and Social Measurement 3/4 (1974).
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.diffusion import diffusion_of, no_more_than_calm
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.unknown_modes import causal_deviance
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import SKID, Candidate, candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.scan import scan
from wmr_replay.gap.settings import GateSettings
from wmr_replay.gap.settings.search import UnlabelledSettings
from wmr_schemas.arrays import F64
from wmr_schemas.modes import ContactMode

Deviance = Callable[[Extension], F64]
"""−2 log likelihood of each row (n,)."""


class Point(NamedTuple):
    """A model with some effects more, −2 log likelihood (n,) of the rows, and the price of the sizes."""

    candidates: tuple[Candidate, ...]
    extension: Extension
    rows: F64
    price: float

    @property
    def cost(self) -> float:
        """−2 log likelihood of the log, and the price; infinite where it fails."""
        cost = float(self.rows.sum()) + self.price
        return cost if np.isfinite(cost) else np.inf

    @property
    def keys(self) -> list[tuple[Candidate, str]]:
        """The effects' parameters (p,)."""
        return [(candidate, key) for candidate in self.candidates for key in candidate.free]

    def moved(self, step: F64, deviance: Deviance) -> "Point":
        """The effects' sizes changed by ``step`` (p,), within their bounds."""
        effects = {one.name: dict(self.extension.effects[one.name]) for one in self.candidates}
        for (candidate, key), by in zip(self.keys, step.tolist(), strict=True):
            moved = float(np.clip(effects[candidate.name][key] + by, *candidate.bounds[key]))
            effects[candidate.name][key] = moved
        extension = self.extension
        for name, sizes in effects.items():
            extension = extension.with_effect(name, sizes)
        return self._replace(extension=extension, rows=deviance(extension))


def likeliest_models(problem: Problem, base: Fit) -> list[Extension]:
    """The base model with one lasting effect: the likeliest whatever the modes, and what is nearly as likely.

    None that is not clearly likelier than the base model, and none where the identifier sees the robot roll.
    Disturbances are calm, so that they do not explain what is missing.
    """
    own, settings = problem.settings.unlabelled, problem.settings
    if np.mean(problem.binned.mode != ContactMode.IDEAL) <= settings.modes.much_slip:
        return []
    rolling, noise = all_rolling(problem), no_more_than_calm(base.noise, settings.diffusion)
    deviance = unlabelled_deviance(rolling, noise)
    noises = (noise, diffusion_of(settings.diffusion.start_log, settings.diffusion))
    nothing = float(deviance(base.extension).sum())
    found = likeliest_points(rolling.all_fitted(), base.extension, deviance, noises, nothing)
    if not found:
        return []
    most = min(nothing - settings.modes.least_doubt, found[0].cost + settings.modes.hopeless)
    return [one.extension for one in found[: own.most_models] if one.cost < most]


def all_rolling(problem: Problem) -> Problem:
    """The log, or the part of it that the problem holds, without contact modes, in longer bins."""
    settings, t_s = problem.settings, problem.binned.t_s
    bin_s = settings.unlabelled.coarse * settings.bins.bin_s
    whole = Problem.of(bin_log(problem.binned.log, settings, None, bin_s))
    first = int(np.searchsorted(whole.binned.t_s, t_s[0], side="left"))
    end = int(np.searchsorted(whole.binned.t_s, t_s[-1], side="right"))
    return whole if end - first == len(whole.binned) else whole.part(slice(first, end))


def unlabelled_deviance(rolling: Problem, noise: Diffusion) -> Deviance:
    """−2 log likelihood of each row of a log whose modes are not known, by models with this diffusion."""
    unlabelled = replace(rolling, train=np.zeros(len(rolling.binned), bool))
    return lambda extension: causal_deviance(unlabelled, extension, noise)


def likeliest_points(
    rolling: Problem, base: Extension, deviance: Deviance, noises: Iterable[Diffusion], nothing: float
) -> list[Point]:
    """Of the lasting effects that promise most, each at its likeliest sizes, the likeliest first.

    ``nothing`` is the base model's −2 log likelihood. Sizes start where a scan puts them that takes the robot
    to be ``rolling``, at each of the ``noises``: at no size, the rows that show an effect most are called
    slipping, and do not see its slope.
    """
    candidates = rolling.settings.candidates
    points: dict[str, Point] = {}
    for scored in chain.from_iterable(scan(rolling, base, noise).scored for noise in noises):
        if scored.gain > candidates.least_gain and is_lasting(candidate_of(scored.name)):
            extension = base.with_effect(scored.name, scored.parameters)
            candidate = candidate_of(scored.name)
            price = len(candidate.free) * float(np.log(3 * len(rolling.binned)))
            point = Point((candidate,), extension, deviance(extension), price)
            points[scored.name] = min(point, points.get(scored.name, point), key=cost_of_point)
    return likeliest_sizes(points.values(), deviance, nothing, rolling.settings)


def likeliest_sizes(
    points: Iterable[Point], deviance: Deviance, nothing: float, settings: GateSettings
) -> list[Point]:
    """The points that promise most, each at its likeliest sizes, the likeliest first."""
    own, promising = settings.unlabelled, settings.candidates.promising
    best = sorted(points, key=cost_of_point)[: own.most_climbed]
    gains = [nothing - point.cost for point in best]
    chosen = [
        point
        for point, gain in zip(best, gains, strict=True)
        if point is best[0] or 0 < promising * gains[0] <= gain
    ]
    return sorted((climbed(point, deviance, own) for point in chosen), key=cost_of_point)


def is_lasting(candidate: Candidate) -> bool:
    """Whether an effect acts at all times, in proportion to its sizes, and is no mode."""
    declaration = candidate.declaration
    return declaration.extent == "always" and candidate.name != SKID and not candidate.grid


def cost_of_point(point: Point) -> float:
    """:attr:`Point.cost`."""
    return point.cost


def slopes_of(point: Point, deviance: Deviance) -> F64:
    """∂D_k/∂θ (n, p) of the effects' sizes, by differences."""
    steps = np.diag([candidate.steps[key] for candidate, key in point.keys])
    moved = [point.moved(step, deviance).rows - point.rows for step in steps]
    return np.asarray(np.column_stack(moved) / np.diag(steps))


def newton_step(slopes: F64) -> F64:
    """The step (p,) to the least cost by its slopes (n, p) and their curvature; 0 along what acts nowhere."""
    scale = np.sqrt(np.maximum(np.square(slopes).sum(axis=0), 1e-300))
    scaled = slopes / scale
    step, *_ = np.linalg.lstsq(scaled.T @ scaled, -2 * scaled.sum(axis=0), rcond=1e-9)
    return np.asarray(step / scale)


def climbed(point: Point, deviance: Deviance, own: UnlabelledSettings) -> Point:
    """The effects at their likeliest sizes, in a few steps."""
    for _ in range(own.most_steps):
        before, step = point, newton_step(slopes_of(point, deviance))
        point = furthest(point, step, deviance, own)
        if before.cost - point.cost < own.enough:
            break
    return point


def furthest(point: Point, step: F64, deviance: Deviance, own: UnlabelledSettings) -> Point:
    """The likeliest point along a step, of which ever more is taken while that pays, or less where it does
    not: far from the likeliest sizes, rows that slip with them and roll without have the steepest slopes.
    """
    best, share = point, 1.0
    while own.least_share < share < 1 / own.least_share:
        tried = point.moved(share * step, deviance)
        if tried.cost < best.cost:
            best, share = tried, share * own.factor
        elif best is point and share <= 1:
            share /= own.factor
        else:
            break
    return best
