"""The sizes of the declared form that comes closest to what a plant hides in another form, without noise.

An interval for a hidden effect of another form is asked to hold these sizes, not the drawn ones. The distance
is that of the oracle: innovations in units of their standard deviation. The least distance is found by
Gauss and Newton from the drawn sizes, along what the log shows of them; a time of a load is scanned first.
Where an answer says a formula beside the effect, the two together come closest.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term, parse_term
from worlds.case import World
from worlds.oracle_filter import Steps, steps_of, whitened
from worlds.oracle_forms import STEP_S, Signals, Trace, accelerating, signals_of, trace
from worlds.plant_forms import plant_trace

Sizes = dict[str, float]
STEP_SHARE = 0.02
STEPS = {"t0_s": 0.1, "start_s": 0.1, "end_s": 0.1, "x_m": 0.05, "y_m": 0.05, "radius_m": 0.05, "loss": 0.02}
"""How far a parameter is moved for its derivative; others by 2 %. A lag's memory is a share of itself."""
SCANNED = {"t0_s": np.linspace(-1.0, 1.0, 21)}
FRICTIONS = ("rolling_resistance", "scrub_torque", "wheel_coulomb")
DRY_SPEEDS_MPS = (0.005, 0.007, 0.01, 0.014, 0.02, 0.028, 0.04)
"""The speed over which a friction changes its sign is no size of it, and left to the log."""
ROUNDS, SHARES = 6, (1.0, 0.5, 0.25, 0.1)
LEAST_SEEN = 1e-3
"""Directions seen this much worse than the best one stay as drawn."""
WITHHOLDING = ("torque_deadzone", "torque_saturation")
CORNERS = (0.0, 0.03, 0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.35, 0.5)
LARGEST_STEPS = 5.0
"""A round moves no parameter by more than so many of its steps."""
CLOSE = 1e-4
CHANNELS = {"longitudinal": "long", "lateral": "lat", "yaw": "turn"}


def fitted_sizes(world: World, same_form: frozenset[str], beside: Sequence[str] = ()) -> Sizes:
    """Sizes that an interval should hold: the best fit for another form, else those that were drawn.

    ``beside`` names the terms of a formula with which the effect is said: they take what they can.
    """
    name = world.case.effect
    if not name or name in same_form:
        return world.sizes
    s = signals_of(world)
    steps, of_plant = steps_of(s, world.conditions, world.case.noise_sd), plant_trace(world, s)
    terms = [term_trace(parse_term(term), s) for term in beside]
    searches = [Search(name, form, steps, of_plant, terms) for form in forms(name, s)]
    found = [search.least(search.scanned(world.sizes)) for search in searches]
    left = [float((search.left([sizes]) ** 2).sum()) for search, sizes in zip(searches, found, strict=True)]
    return found[int(np.argmin(left))]


def forms(name: str, s: Signals) -> list[Signals]:
    """The signals with each value of what the declared form of an effect leaves open."""
    if name in FRICTIONS:
        return [replace(s, dry_mps=speed) for speed in DRY_SPEEDS_MPS]
    if name in WITHHOLDING:
        return [replace(s, corner=share) for share in CORNERS]
    return [s]


def term_trace(term: Term, s: Signals) -> Trace:
    """What a formula's term adds, at a coefficient of 1."""
    columns = {
        "v": s.v, "v_lat": s.w, "yaw": s.yaw, "yaw_rate": s.q, "effort_sum": s.right + s.left,
        "effort_diff": s.right - s.left, "t": s.t_s, "x": s.x, "y": s.y, "s": np.cumsum(s.v) * STEP_S,
    }  # fmt: skip
    return accelerating(s, **{CHANNELS[term.channel]: term.evaluate(columns)})


class Search:
    """Distances between the plant's trace and declared ones, beside which terms take what they can."""

    def __init__(
        self, name: str, s: Signals, steps: Steps, of_plant: Trace, terms: Sequence[Trace] = ()
    ) -> None:
        self.name, self.s, self.steps, self.of_plant = name, s, steps, of_plant
        self.free = np.linalg.qr(whitened(steps, list(terms)))[0] if terms else np.zeros((0, 0))

    def left(self, tried: Sequence[Sizes]) -> F64:
        """What each choice of sizes leaves of the plant's innovations (3·n, choices)."""
        declared = [self.declared(sizes) for sizes in tried]
        columns = whitened(self.steps, [self.of_plant, *declared])
        left = columns[:, :1] - columns[:, 1:]
        return left - self.free @ (self.free.T @ left) if self.free.size else left

    def declared(self, sizes: Sizes) -> Trace:
        """The declared trace, without the tyres' side force, which the plant's trace has not either."""
        found = trace(self.name, sizes, self.s)
        if self.name == "low_friction_patch":
            found = replace(found, acceleration=found.acceleration * [[1.0], [0.0], [1.0]])
        return found

    def scanned(self, sizes: Sizes) -> Sizes:
        """The sizes, with the times of ``SCANNED`` put where the least is left."""
        for key in SCANNED.keys() & sizes.keys():
            tried = [sizes | {key: sizes[key] + shift} for shift in SCANNED[key].tolist()]
            sizes = tried[int(np.argmin((self.left(tried) ** 2).sum(axis=0)))]
        return sizes

    def least(self, sizes: Sizes) -> Sizes:
        """Where Gauss and Newton end."""
        for _ in range(ROUNDS):
            step = {key: STEPS.get(key, STEP_SHARE * abs(value)) for key, value in sizes.items()}
            left = self.left([sizes, *(sizes | {key: sizes[key] + step[key]} for key in sizes)])
            moves = np.linalg.lstsq(left[:, :1] - left[:, 1:], left[:, 0], rcond=LEAST_SEEN)[0]
            moves *= min(1.0, LARGEST_STEPS / max(float(np.abs(moves).max()), 1e-12))
            tried = [
                {
                    key: value + share * move * step[key]
                    for (key, value), move in zip(sizes.items(), moves, strict=True)
                }
                for share in SHARES
            ]
            costs = (self.left(tried) ** 2).sum(axis=0)
            here = float(left[:, 0] @ left[:, 0])
            if costs.min() > (1 - CLOSE) * here:
                break
            sizes = tried[int(np.argmin(costs))]
        return {key: float(value) for key, value in sizes.items()}
