"""Which names a log's data cannot separate, with the true plant, the true modes and the noise-free motion.

The hidden effect's trace and those of all rivals are seen through noise and disturbance (``oracle_filter``).
Two numbers decide, both expected differences of twice the log-likelihood:

    own     of the hidden effect against nothing: |g|²
    left    of the hidden effect against a rival with its best size, time or place: min over θ of |g − R θ|²,
            beside what a tool that identifies modes cannot know of them (``oracle_modes.shifts_of_modes``)

Such a difference of mean λ has the standard deviation 2√λ where both models are given. A tool that holds a
margin of 10 (its rivals within 10 of BIC are alternatives) sees the margin kept in 97.5 % of the logs from
λ − 4√λ > 10 on, that is λ > 33. Below, a rival may be said beside the truth. A tool that looks at 26 effects
and errs in 1 % of the logs asks for 12.7 of χ²; √λ = √12.7 + 1.96 gives λ = 31 for the same 97.5 %: below,
a refusal is right. It is right, too, where the effect moves the path by less than the tolerance of ``gap``.

Traction that is lost in a time or place may be the model's own slipping, and another cornering stiffness
the model's own skidding at slightly other times: ``slipping`` and ``skidding`` stand among the rivals, each
in the mode history that comes nearest (``oracle_modes``). A refusal that says so is right where such a rival
leaves less than 33: a tool that identifies modes cannot exclude that history.

The first plant's actuator lag has two poles. It is neither the declared lag of one pole nor a delay, but lies
between them: a tool that says both says what there is. A delay alone stays wrong.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, Bool
from wmr_schemas.effects import effects_of
from worlds.case import World
from worlds.oracle_filter import Steps, beside_the_unsure, moved_m, steps_of, unsure_of, whitened
from worlds.oracle_forms import STEP_S, Signals, Trace, losing, signals_of, trace
from worlds.oracle_local import left_of_patch, pieces_by_block
from worlds.oracle_modes import (
    Histories,
    nearest_skidding,
    nearest_slipping,
    pieces_about,
    shifts_of_modes,
    shifts_of_skids,
    toggled,
)

SEPARATED = 33.0
SEEN = 31.0
TOLERANCE_M, TOLERANCE_S = 0.003, 4.0
SLIPPING, SKIDDING = "slipping", "skidding"
NO_NAME = ("undeclared_skid",)
"""Never right where modes are identified: the true modes hold every skid."""
LOCAL_LOSS = ("slip_interval", "low_friction_patch")
LOCAL = (*LOCAL_LOSS, "load_step")
BETWEEN_FORMS = {(1, "actuator_lag"): "input_delay"}
"""By plant and effect, the declared form beside the effect's own between which the hidden one lies."""
NONNEGATIVE = (0.0, np.inf)
NEAR = (0.8, 1.25)
"""A curve at a grid value stands for its neighbours: its size may be that of the next value."""
FREE = (-np.inf, np.inf)
COARSE_S, FINE_S = 3.0, 0.5
"""Spacing of a rival's times and places, fine where the hidden effect is itself of one time or place."""
RADII_M = (0.5, 0.8, 1.2, 2.0, 3.5)


@dataclass(frozen=True)
class Block:
    """Parameter sets of a rival whose traces add up, each times a size within ``bounds``."""

    name: str
    parameters: tuple[dict[str, float], ...]
    bounds: tuple[float, float] = FREE


LINEAR = {
    "payload": ("mass_ratio", FREE),
    "yaw_inertia": ("ratio", FREE),
    "drive_gain": ("ratio", FREE),
    "rolling_resistance": ("c0_mps2", NONNEGATIVE),
    "viscous_drag": ("c1_per_s", NONNEGATIVE),
    "aerodynamic_drag": ("c2_per_m", NONNEGATIVE),
    "scrub_torque": ("d0_mps2", NONNEGATIVE),
    "yaw_damping": ("d1_per_s", NONNEGATIVE),
    "wheel_coulomb": ("torque_nm", NONNEGATIVE),
    "wheel_viscous": ("nm_per_radps", NONNEGATIVE),
    "torque_imbalance": ("ratio", FREE),
    "torque_bias_common": ("bias_nm", FREE),
    "torque_bias_differential": ("bias_nm", FREE),
    "com_offset": ("offset_m", FREE),
    "heading_misalignment": ("angle_rad", FREE),
    "yaw_drift": ("rate_radps", FREE),
    "cornering_stiffness": ("ratio", FREE),
}
VECTORS = {"slope": ("grade_x_mps2", "grade_y_mps2"), "pose_lever_arm": ("x_m", "y_m")}
UNIT = 0.1
"""Size at which a trace is computed that is linear in its size, or nearly so."""
SHARES = (0.03, 0.06, 0.1, 0.16, 0.24, 0.35, 0.5, 0.7, 0.85, 0.95)
"""Dead zones and limits, as shares of the largest torque."""
TIMES_S = (0.015, 0.025, 0.04, 0.06, 0.09, 0.13, 0.19, 0.27, 0.38)


def blocks(s: Signals, every_s: float) -> Iterator[Block]:
    """All rivals but traction lost in a stretch of time; times and places are ``every_s`` apart."""
    for name, (parameter, bounds) in LINEAR.items():
        yield Block(name, ({parameter: UNIT},), bounds)
    yield Block(
        "slope", ({"grade_x_mps2": UNIT, "grade_y_mps2": 0.0}, {"grade_x_mps2": 0.0, "grade_y_mps2": UNIT})
    )
    yield Block("pose_lever_arm", ({"x_m": UNIT, "y_m": 0.0}, {"x_m": 0.0, "y_m": UNIT}))
    largest = float(np.max(np.abs([s.left, s.right])))
    for share in SHARES:
        yield Block("torque_deadzone", ({"threshold_nm": share * largest},), NEAR)
        yield Block("torque_saturation", ({"limit_nm": share * largest},), NEAR)
    for time_s in TIMES_S:
        yield Block("actuator_lag", ({"time_constant_s": time_s},), NEAR)
        yield Block("input_delay", ({"delay_s": time_s},), NEAR)
        yield Block("input_delay", ({"delay_s": -time_s},), NEAR)
    for t0_s in np.arange(every_s, s.t_s[-1], every_s):
        yield Block("load_step", ({"mass_ratio": UNIT, "t0_s": float(t0_s)},))
    for k in range(0, len(s.t_s), round(every_s / STEP_S)):
        for radius_m in RADII_M:
            place = {"x_m": float(s.x[k]), "y_m": float(s.y[k]), "radius_m": radius_m}
            yield Block("low_friction_patch", (place | {"loss": 1.0},), (0.0, 1.0))


def stretches(s: Signals, every_s: float) -> list[Trace]:
    """All traction lost in one stretch of time, for each stretch: neighbours add up to an interval."""
    starts = np.arange(0.0, s.t_s[-1], every_s)
    return [losing(s, ((s.t_s >= a) & (s.t_s < a + every_s)).astype(float)) for a in starts]


@dataclass(frozen=True)
class Judgement:
    """The oracle's word on a log: what separates the hidden effect from nothing, and from each near rival."""

    own: float
    moved_m: float
    rivals: dict[str, float]

    @property
    def may_refuse(self) -> bool:
        """Whether a refusal, or silence, is right."""
        return self.own < SEEN or self.moved_m < TOLERANCE_M

    @property
    def inseparable(self) -> frozenset[str]:
        """Rivals that may be said beside the truth."""
        return frozenset(name for name, left in self.rivals.items() if left < SEPARATED)


def left_over(g: F64, columns: F64, bounds: tuple[float, float]) -> float:
    """The square of what the columns leave of ``g``; one column keeps to the bounds."""
    if columns.shape[1] == 1:
        column = columns[:, 0]
        power = float(column @ column)
        size = min(max(float(column @ g) / power, bounds[0]), bounds[1]) if power > 1e-12 else 0.0
        return float(np.sum((g - size * column) ** 2))
    size_found = np.linalg.lstsq(columns, g, rcond=None)[0]
    return float(np.sum((g - columns @ size_found) ** 2))


def nearest_interval(g: F64, pieces: F64) -> float:
    """The least that is left of ``g`` behind an interval of whole stretches, its loss in [0, 1]."""
    power, n = float(g @ g), pieces.shape[1]
    along = np.concatenate([[0.0], np.cumsum(pieces.T @ g)])
    gram = np.zeros((n + 1, n + 1))
    gram[1:, 1:] = np.cumsum(np.cumsum(pieces.T @ pieces, axis=0), axis=1)
    diagonal = np.diag(gram)
    own = np.maximum(diagonal[:, None] + diagonal - gram - gram.T, 1e-12)
    shared = along - along[:, None]
    size = np.clip(shared / own, 0.0, 1.0)
    left = power - 2 * size * shared + size**2 * own
    return max(float(left[np.triu_indices(n + 1, 1)].min()), 0.0)


def exact_class(name: str) -> frozenset[str]:
    """Names that give the same poses as ``name`` alone, whatever is driven."""
    found = effects_of("torque")[name].exact
    classes = [exact.same_as for exact in found if not exact.beside and "torque" in exact.driven_by]
    return frozenset(other for same in classes for other in same) - {name}


def where_lost(s: Signals, name: str, sizes: dict[str, float]) -> Bool:
    """Where (n,) the hidden loss acts."""
    lost = trace(name, sizes | {"loss": 1.0}, s).acceleration
    return (np.abs(lost[0]) + np.abs(lost[2])) > 0


def judged(world: World) -> Judgement:
    """The oracle's word on a world with a hidden effect."""
    name, s = world.case.effect, signals_of(world)
    hidden = trace(name, world.sizes, s)
    every_s = FINE_S if name in LOCAL else COARSE_S
    others = [block for block in blocks(s, every_s) if block.name != name]
    traces = [hidden, *(trace(block.name, p, s) for block in others for p in block.parameters)]
    pieces, steps = stretches(s, every_s), steps_of(s, world.conditions, world.case.noise_sd)
    columns = whitened(steps, [*traces, *pieces])
    own, unsure = columns[:, 0], unsure_of(steps, shifts_of_modes(s))
    columns = beside_the_unsure(unsure, columns)
    g, rivals, place, patch = columns[:, 0], dict[str, float](), 1, dict[str, float]()
    for block in others:
        width = len(block.parameters)
        left = left_over(g, columns[:, place : place + width], block.bounds)
        if block.name == "low_friction_patch" and left < rivals.get(block.name, np.inf):
            patch = block.parameters[0]
        rivals[block.name] = min(rivals.get(block.name, np.inf), left)
        place += width
    if name != "slip_interval":
        rivals["slip_interval"] = nearest_interval(g, columns[:, place : place + len(pieces)])
    if (world.case.plant, name) in BETWEEN_FORMS:
        rivals[BETWEEN_FORMS[world.case.plant, name]] = 0.0
    rivals |= dict.fromkeys(exact_class(name) & set(effects_of("torque")), 0.0)
    others_beyond = own_modes(world, s, steps, own) | losses_beyond_the_grid(world, s, unsure, g, patch)
    for other, left in others_beyond.items():
        rivals[other] = min(left, rivals.get(other, np.inf))
    return Judgement(float(own @ own), moved_m(steps, hidden, TOLERANCE_S), rivals)


def own_modes(world: World, s: Signals, steps: Steps, g: F64) -> dict[str, float]:
    """What the model's own modes leave of ``g``."""
    if world.case.effect in LOCAL_LOSS:
        spans = pieces_about(s, where_lost(s, world.case.effect, world.sizes))
        toggles = whitened(steps, [toggled(s, span) for span in spans])
        return {SLIPPING: nearest_slipping(g, toggles, Histories(spans, s.slips))}
    if world.case.effect == "cornering_stiffness" and (shifts := shifts_of_skids(s)):
        return {SKIDDING: nearest_skidding(g, whitened(steps, shifts))}
    return {}


def losses_beyond_the_grid(
    world: World, s: Signals, steps: Steps, g: F64, patch: dict[str, float]
) -> dict[str, float]:
    """What losses of traction whose ends lie on no grid leave of ``g``; ``patch`` is its nearest one."""
    if world.case.effect == "slip_interval":
        return {"low_friction_patch": left_of_patch(s, steps, g, patch)}
    if world.case.effect == "low_friction_patch":
        parts = pieces_by_block(s, steps, where_lost(s, world.case.effect, world.sizes))
        return {"slip_interval": min(nearest_interval(g, part) for part in parts)}
    return {}
