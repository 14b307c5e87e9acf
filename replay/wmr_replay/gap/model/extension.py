"""Effects by name and parameters → θ, input rows and poses, as the filter and the simulation take them."""

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from wmr_replay.effects.efforts import InputEffects, input_effects
from wmr_replay.effects.local import local_weight
from wmr_replay.effects.own import acting, own_accelerations, own_efforts, without_own_errors
from wmr_replay.effects.theta import Theta, theta_of
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.caster_swings import swings
from wmr_replay.gap.model.dictionary import columns_of, own_columns_of
from wmr_replay.gap.model.dynamics import LEAST_SPEED_MPS, N_ROW, Base, Row
from wmr_replay.gap.model.inputs import TorqueHistory
from wmr_schemas.arrays import F64
from wmr_schemas.effects import FRICTIONS, UNNAMED_PREFIX, WITHHOLDING, own_effects
from wmr_schemas.effects.own import OWN_ACCELERATIONS, Columns
from wmr_schemas.model_file import Effect
from wmr_schemas.modes import ContactMode
from wmr_schemas.slip_terms import is_slip_term
from wmr_schemas.terms import COEFFICIENT, Term, parse_term

Parameters = Mapping[str, float]
STIFFEST = 10.0
"""From this stiffness ratio on, an undeclared skid is an elastic sideslip, 1/``LEAST_UNDECLARED``."""
LOOSE_MPS = 0.2
"""Largest standard deviation of v_lat at a change of skidding: what builds up before a label follows."""
LEAST_LOOSE_MPS = 0.002
"""Least one: a calm lateral velocity (``DiffusionSettings.calm``)."""
TERM_COLUMNS = {
    "longitudinal": (Row.EXTRA_LONG, Row.LONG_BY_V, Row.LONG_BY_W),
    "yaw": (Row.EXTRA_YAW, Row.YAW_BY_V, Row.YAW_BY_W),
}
"""Where the rows hold what terms do: an acceleration, and its slopes by v_long and w."""
OWN_SPEEDS = ("v_mps", "yaw_rate_radps")
SECANT_MPS = 0.05
"""Change of speed over which a term's slope is taken: friction changes its sign within less."""
WEIGHTS = {"load_step": Row.LOAD, "low_friction_patch": Row.PATCH, "slip_interval": Row.SLIP}
"""Where the rows hold what the effects in time or space do: their sizes too, since a model may have several
of one name. Their places in θ are 1.
"""
LOCAL_PLACES = {
    "load_step": Theta.LOAD_STEP,
    "low_friction_patch": Theta.PATCH,
    "slip_interval": Theta.SLIP,
}


@dataclass(frozen=True)
class Extension:
    """A base model and the effects on top of it, by catalogue name."""

    base: Base
    effects: Mapping[str, Parameters] = field(default_factory=dict)
    wheel_radius_m: float = 1.0
    known: tuple[tuple[str, Parameters], ...] = ()
    """Effects that the base model has already, by name and parameters; they act, and are not fitted."""
    misfit: Mapping[str, float] = field(default_factory=dict)
    """By effect, the size that the base model leaves on its own calibration log."""
    friction_speed_mps: float = 0.0
    """Speed over which friction changes its sign; 0 for the usual one. The log's own, or the base model's."""
    corner_share: float = 0.0
    """Share of its threshold over which a dead zone or a limit of the torques sets in; 0 is at once."""
    held_sideways: bool = False
    """Whether a slope does not move the robot sideways where it is said to skid."""

    def with_effect(self, name: str, parameters: Parameters) -> "Extension":
        """One effect more, or other parameters for one that is there."""
        return replace(self, effects={**self.effects, name: dict(parameters)})

    def without(self, name: str) -> "Extension":
        """One effect fewer."""
        rest = {key: value for key, value in self.effects.items() if key != name}
        return replace(self, effects=rest)

    def only(self, names: Collection[str]) -> "Extension":
        """With no other effects than those."""
        return replace(self, effects={key: value for key, value in self.effects.items() if key in names})

    @property
    def acting(self) -> list[tuple[str, Parameters]]:
        """Known and new effects."""
        return [*self.known, *self.effects.items()]

    @property
    def own(self) -> list[tuple[str, Parameters]]:
        """Those of them that users added."""
        known = own_effects()
        return [(name, parameters) for name, parameters in self.acting if name in known]

    @property
    def freedoms(self) -> tuple[float, float, bool]:
        """What the declared forms of the effects leave open."""
        return self.friction_speed_mps, self.corner_share, self.held_sideways

    def in_form(self, freedom: str, value: float) -> "Extension":
        """With another value of ``friction_speed_mps`` or ``corner_share``."""
        if freedom == "friction_speed_mps":
            return replace(self, friction_speed_mps=value)
        return replace(self, corner_share=value)

    def as_in(self, other: "Extension") -> "Extension":
        """With the freedoms of another one's effects."""
        speed_mps, corner_share, held_sideways = other.freedoms
        return replace(
            self, friction_speed_mps=speed_mps, corner_share=corner_share, held_sideways=held_sideways
        )

    def with_forms(self, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
        """Effects as a file holds them, with what the model says of their forms."""
        speed_mps, share = self.friction_speed_mps or None, self.corner_share or None
        effects = tuple(replace(e, sign_change_mps=speed_mps) if e.name in FRICTIONS else e for e in effects)
        return tuple(replace(e, corner_share=share) if e.name in WITHHOLDING else e for e in effects)

    def theta(self) -> F64:
        """θ of :mod:`~wmr_replay.gap.model.dynamics`."""
        theta = theta_of(self.acting, self.wheel_radius_m)
        theta[Theta.FRICTION_SPEED] = self.friction_speed_mps
        theta[Theta.HELD_SIDEWAYS] = float(self.held_sideways)
        theta[[LOCAL_PLACES[name] for name, _ in self.acting if name in LOCAL_PLACES]] = 1.0
        return theta

    def input_effects(self) -> InputEffects:
        """Parameters of the effects on the torques."""
        return input_effects(self.acting)._replace(corner_share=self.corner_share)

    def mean_torques(self, binned: BinnedLog) -> F64:
        """Efforts (2, n) as they act, left and right, averaged over each step."""
        torque, effects = binned.torque, self.input_effects()
        if self.own:
            torque = TorqueHistory(torque.t_s, own_efforts(self.own, torque.efforts_nm))
            return torque.means(binned.t_s, effects)
        return binned.inputs.get(effects, lambda: torque.means(binned.t_s, effects))

    def poses(self, binned: BinnedLog) -> F64:
        """Measured poses (n, 3) without the errors that users' effects describe."""
        if not self.own:
            return binned.pose
        return np.ascontiguousarray(without_own_errors(self.own, binned.t_s, binned.pose.T).T)

    @property
    def of_rows(self) -> Hashable:
        """What the input rows of a log follow from: not the effects that act by θ alone."""
        known = own_effects()
        acting = tuple(
            (name, tuple(parameters.items()))
            for name, parameters in self.acting
            if name in WEIGHTS or name in known or name.startswith(UNNAMED_PREFIX)
        )
        return "rows", self.base, self.skids_undeclared, self.input_effects(), acting

    @property
    def skids_undeclared(self) -> bool:
        """Whether steps that are called ideal skid."""
        return any(name == "undeclared_skid" and p["stiffness_ratio"] < STIFFEST for name, p in self.acting)

    def rows(self, binned: BinnedLog, mode: F64 | None = None) -> F64:
        """Input rows (n, 16) of :class:`~wmr_replay.gap.model.dynamics.Row`.

        ``mode`` (n,) are other contact modes than those of the log.
        """
        undeclared = self.skids_undeclared
        if mode is None:
            mode, kind = binned.mode, ("empty rows", self.base, undeclared)
            rows = binned.inputs.get(kind, lambda: self.empty_rows(binned, binned.mode, undeclared)).copy()
        else:
            rows = self.empty_rows(binned, mode, undeclared)
        if any(binned.settings.diffusion.swings):
            half = self.base.half_track_m
            rows[:, Row.SWING] = binned.inputs.get(("swings", half), lambda: swings(binned, half))
        rows[:, Row.LEFT], rows[:, Row.RIGHT] = self.mean_torques(binned)
        names = {name for name, _ in self.acting}
        for name in names & WEIGHTS.keys():
            rows[:, WEIGHTS[name]] = change_by(name, self.acting, binned)
        for name, parameters in self.acting:
            if name.startswith(UNNAMED_PREFIX) and not is_slip_term(name):
                term, half = parse_term(name), self.base.half_track_m
                values = binned.inputs.get((name, half), partial(term_about_speeds, term, binned, half))
                share = parameters[COEFFICIENT] * self.passed_on(term, mode)
                rows[:, TERM_COLUMNS[term.channel]] += values * share[:, None]
        if acting(self.own, "acceleration"):
            half, columns = self.base.half_track_m, own_columns_of(binned)
            both = about_speeds(partial(own_accelerations, self.own), columns, OWN_SPEEDS, half)
            for channel, values in zip(OWN_ACCELERATIONS, both, strict=True):
                rows[:, TERM_COLUMNS[channel]] += values
        return rows

    def empty_rows(self, binned: BinnedLog, mode: F64, undeclared: bool) -> F64:
        """Input rows (n, 16) without torques and effects; ``undeclared`` where those that are ideal skid."""
        rows = np.zeros((len(binned), N_ROW))
        rows[:, Row.DT] = binned.step_s
        rows[:, Row.MODE], rows[:, Row.AGE] = mode, binned.t_s
        skids = (mode % 2 == 1) | (undeclared & (mode == ContactMode.IDEAL))
        if np.any(skids):
            loose = np.clip(skid_speed(binned, self.base), LEAST_LOOSE_MPS, LOOSE_MPS)
            rows[:, Row.LOOSE] = loose * binned.unsure(skids)
        return rows

    def passed_on(self, term: Term, mode: F64) -> F64:
        """The share of a term (n,) that acts: slipping wheels pass on a share of what efforts do."""
        share = self.base.slip_share if term.channel == "longitudinal" else self.base.slip_share_yaw
        slips = (mode >= ContactMode.SLIPPING) & any(column.startswith("effort") for column in term.columns)
        return np.where(slips, share, 1.0)


def term_about_speeds(term: Term, binned: BinnedLog, half_track_m: float) -> F64:
    """A term (n, 3) about the measured speeds."""
    speeds = tuple(name if name in term.columns else "" for name in ("v", "yaw_rate"))
    return about_speeds(term.evaluate, columns_of(binned), speeds, half_track_m)


def about_speeds(
    of: Callable[[Columns], F64], columns: Columns, speeds: Sequence[str], half_track_m: float
) -> F64:
    """A function of columns (..., n) as a + b v_long + c w about the measured speeds, (..., n, 3).

    It acts on the speeds of the model: the measured ones have noise and are smoothed. ``speeds`` are the
    columns of v_long and of the yaw rate; empty where it does not read one.
    """
    here = of(columns)
    found = np.zeros((*here.shape, 3))
    found[..., 0] = here
    for k, (name, arm_m) in enumerate(zip(speeds, (1.0, half_track_m), strict=True), start=1):
        if name:
            ends = (columns[name] + change / arm_m for change in (SECANT_MPS, -SECANT_MPS))
            above, below = (of({**columns, name: end}) for end in ends)
            found[..., k] = (above - below) / (2 * SECANT_MPS)
            found[..., 0] -= found[..., k] * columns[name] * arm_m
    return found


def skid_speed(binned: BinnedLog, base: Base) -> F64:
    """How fast (n,) a skid moves sideways once it has settled, |v·yaw_rate| over its decay rate, m/s.

    Next to a change of skidding, v_lat is this or nothing. A larger freedom costs likelihood in every such
    row, so that with precise poses any skid would seem less likely than none.
    """
    columns = columns_of(binned)
    v, yaw_rate = np.abs(columns["v"]), np.abs(columns["yaw_rate"])
    speed = base.speed_mps or np.maximum(np.hypot(v, base.half_track_m * yaw_rate), LEAST_SPEED_MPS)
    return np.asarray(v * yaw_rate * speed / max(base.skid_decay_mps2, 1e-9))


def change_by(name: str, acting: list[tuple[str, Parameters]], binned: BinnedLog) -> F64:
    """What all effects ``name`` in time or space do at each row (n,): loads add up to a mass ratio, losses of
    traction compose to one loss.
    """
    found = [(p, weight(name, p, binned)) for other, p in acting if other == name]
    if name == "load_step":
        return np.asarray(sum((p["mass_ratio"] * acts for p, acts in found), np.zeros(len(binned))))
    kept = np.ones(len(binned))
    for p, acts in found:
        kept = kept * (1.0 - p["loss"] * acts)
    return 1.0 - kept


def weight(name: str, parameters: Parameters, binned: BinnedLog) -> F64:
    """How much of an effect in time or space acts at each row (n,), 0 to 1."""
    return local_weight(name, parameters, binned.t_s, binned.pose[:, :2])
