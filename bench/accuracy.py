"""Accuracy by algorithm, signal and noise at one delay.

The parameters are chosen on one realisation of noise and scored on another.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from cases import DELAY_S, SIGNALS, STEP_S, Realisation, realise
from peers import FINITE, IRREGULAR_ONLY, RECURSIVE, SLOW, WINDOW_STEPS, Candidates, Estimate

from wmr_replay.differentiate import AdaptiveDifferentiator, Differentiator, KernelSpec
from wmr_replay.differentiate.tuning import tune
from wmr_schemas.arrays import F64

HEAD_ROWS = 2000
"""Rows on which slow peers choose their parameters; ``tune`` chooses on the same rows, without truth."""
NOISES = (0.001, 0.01, 0.1)


def run_stage(stage: Differentiator | AdaptiveDifferentiator, r: Realisation) -> F64:
    """Estimates (n,) of a stage on a realisation."""
    return np.asarray(stage.push(r.t_ns, r.noisy[None], np.empty((0, len(r.t_ns)))).estimates[0, r.order])


def spec_at(steps: int, degree: int, kappa: int, mu: int, shares: tuple[float, ...] = ()) -> KernelSpec:
    """The kernel whose described instant lies ``DELAY_S`` before its newest sample."""
    return KernelSpec(degree, kappa, mu, 1 - 2 * DELAY_S / (steps * STEP_S), shares)


def fixed_window(spec: KernelSpec, steps: int) -> Estimate:
    """Our differentiator with one window."""
    return lambda r: run_stage(Differentiator(spec, window_s=steps * STEP_S, step_s=STEP_S), r)


def shared_window(train: Realisation, steps: int, mu: int) -> tuple[str, Estimate]:
    """Our differentiator with one window, exact to degree 2.

    The shares of degrees 3 to 5 are fitted to the truth by least squares.
    """
    nested = np.stack(
        [fixed_window(spec_at(steps, n, 0, mu), steps)(train)[train.scored] for n in (2, 3, 4, 5)]
    )
    gap = train.truth[train.scored] - nested[0]
    shares = tuple(np.linalg.lstsq(np.diff(nested, axis=0).T, gap, rcond=1e-9)[0].tolist())
    label = f"T {steps * STEP_S:.3g}, N 2, mu {mu}, shares " + " ".join(f"{share:.2f}" for share in shares)
    return label, fixed_window(spec_at(steps, 2, 0, mu, shares), steps)


def adaptive_window(degree: int, first: int, last: int, confidence: float) -> Estimate:
    """Our adaptive differentiator: several windows at one delay."""
    windows_s = tuple(s * STEP_S for s in WINDOW_STEPS[first:last])
    options = {"windows_s": windows_s, "step_s": STEP_S, "common_delay_s": DELAY_S, "confidence": confidence}
    return lambda r: run_stage(
        AdaptiveDifferentiator(KernelSpec(degree), sigma=np.array([r.sigma]), **options), r
    )


def ours(train: Realisation) -> Candidates:
    """Our candidates: fixed windows with whole degrees, fixed windows with shares, and adaptive windows."""
    grid = [
        (steps, spec_at(steps, n, k, m))
        for steps, n, (k, m) in product(WINDOW_STEPS, (2, 3, 4, 5), ((0, 0), (0, 1), (1, 1)))
        if steps >= n + 2
    ]
    whole = [
        (f"T {s * STEP_S:.3g}, N {p.degree}, kappa {p.kappa}, mu {p.mu}", fixed_window(p, s)) for s, p in grid
    ]
    shared = [shared_window(train, steps, mu) for steps, mu in product(WINDOW_STEPS, (0, 1))]
    choices = product((2, 3), (1, 3, 5), (9, len(WINDOW_STEPS)), (1.5, 2.0, 3.0))
    adaptive = [
        (f"adaptive, N {n}, T {WINDOW_STEPS[a] * STEP_S:.2g} up, {c:g} sd", adaptive_window(n, a, b, c))
        for n, a, b, c in choices
    ]
    return [*whole, *shared, *adaptive]


def tuned_without_truth(train: Realisation) -> Estimate:
    """Our differentiator with the kernel that ``tune`` chooses on the noisy head of ``train``."""
    t_s = (train.t_ns - train.t_ns[0])[:HEAD_ROWS] * 1e-9
    uniform = np.interp(np.arange(0, t_s[-1], STEP_S), t_s, train.noisy[:HEAD_ROWS])
    found = tune(uniform, train.sigma, DELAY_S, step_s=STEP_S, order=train.order)
    held = round((DELAY_S - found.choice.delay_s) / STEP_S)

    def estimate(r: Realisation) -> F64:
        out = run_stage(Differentiator(found.spec, window_s=found.window_s, step_s=STEP_S), r)
        return out if held <= 0 else np.concatenate([np.full(held, np.nan), out[:-held]])

    return estimate


@dataclass(frozen=True)
class Score:
    """The parameters that an algorithm chose, and its error on the other realisation."""

    label: str
    rmse: float


def choose_and_score(candidates: Candidates, train: Realisation, test: Realisation) -> Score | None:
    """The candidate with the least error on ``train``, scored on ``test``."""
    if not candidates:
        return None
    errors = [train.rmse(estimate(train)) for _, estimate in candidates]
    label, estimate = candidates[int(np.argmin(errors))]
    return Score(label, test.rmse(estimate(test)))


Makers = dict[str, Callable[[int], Candidates]]


def score_all(makers: Makers, train: Realisation, test: Realisation) -> dict[str, Score]:
    """The best candidate of every algorithm of a family."""
    scores = {}
    for name, make in makers.items():
        score = choose_and_score(make(train.order), train.head(HEAD_ROWS) if name in SLOW else train, test)
        if score is not None:
            scores[name] = score
    return scores


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    ours: Score
    tuned: float
    finite: dict[str, Score]
    recursive: dict[str, Score]

    @property
    def ratio(self) -> float:
        """Our error over that of the best finite-window peer; the requirement is at most 1.02."""
        return self.ours.rmse / min(score.rmse for score in self.finite.values())

    def cells(self) -> list[str]:
        """The cells of the table's row."""
        peers = {**self.finite, **self.recursive}
        listed = [f"{peers[n].rmse:.3g}" if n in peers else "–" for n in (*FINITE, *RECURSIVE)]
        best = min(self.recursive.values(), key=lambda s: s.rmse).rmse
        return [
            self.case,
            f"{self.ours.rmse:.3g}",
            f"{self.tuned:.3g}",
            *listed,
            f"{self.ratio:.3f}",
            f"{self.ours.rmse / best:.3f}",
        ]


HEAD = [
    "signal, order, noise",
    "ours",
    "ours, `tune`",
    *FINITE,
    *RECURSIVE,
    "ours / finite",
    "ours / recursive",
]


def accuracy_row(name: str, order: int, sigma: float, irregular: bool) -> Row:
    """One case: the second realisation differs in noise and, where irregular, in stamps."""
    train = realise(SIGNALS[name], order, sigma, irregular, seed=1)
    test = realise(SIGNALS[name], order, sigma, irregular, seed=2)
    own = choose_and_score(ours(train), train, test)
    assert own is not None
    tuned = test.rmse(tuned_without_truth(train)(test))
    usable = {n: make for n, make in FINITE.items() if irregular or n not in IRREGULAR_ONLY}
    finite, recursive = score_all(usable, train, test), score_all(RECURSIVE, train, test)
    case = f"{name}, {order}, {sigma:g}" + (", irregular" if irregular else "")
    return Row(case, own, tuned, finite, recursive)


def cases(quick: bool) -> list[tuple[str, int, float, bool]]:
    """All cases, or a few for a quick run."""
    if quick:
        return [
            ("three sines", 1, 0.01, False),
            ("switching", 1, 0.01, False),
            ("three sines", 1, 0.01, True),
        ]
    uniform = [(n, o, s, False) for n, o, s in product(SIGNALS, (1, 2), NOISES)]
    return uniform + [
        (n, o, s, True) for n, o, s in product(("three sines", "switching"), (1, 2), (0.001, 0.1))
    ]
