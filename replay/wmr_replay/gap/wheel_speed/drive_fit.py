"""The drive told by the wheels themselves, where a log has commands and measured wheel speeds.

All effects of the drive are fitted together to what the wheels did, and those go, one by one, without which
the fit is not clearly worse. A search that adds one effect after the other begins wrongly here: wheels that
keep their speed look like a limit of the acceleration wherever a gain or another limit is not yet known.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.settings.wheel_speed import DriveSettings
from wmr_replay.gap.wheel_speed.candidates import parameters_of
from wmr_replay.gap.wheel_speed.declared import DECLARED
from wmr_replay.gap.wheel_speed.drive import Chassis, Values, wheel_speeds
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, summed
from wmr_replay.gap.wheel_speed.record import Record
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.effects import EffectDeclaration


@dataclass(frozen=True, eq=False)
class Wheels:
    """What the wheels did: speeds (2, n) at the record's rows between poses, and the stretch of each row."""

    record: Record
    chassis: Chassis
    base: Values
    rows: Bool
    measured: F64
    stretch: I64

    @classmethod
    def of(cls, problem: Problem, measured: Record) -> "Wheels":
        """The wheels of ``problem``, commanded, as ``measured`` has them."""
        record = problem.record
        stretch = np.repeat(np.arange(record.n_stretches), np.diff(record.first))
        begin, end = record.pose_s[record.first_pose[:-1]], record.pose_s[record.first_pose[1:] - 1]
        rows = (record.time_s > begin[stretch]) & (record.time_s < end[stretch])
        speeds = [
            np.interp(record.time_s[rows], measured.time_s, w)
            for w in (measured.left_radps, measured.right_radps)
        ]
        return cls(record, problem.chassis, problem.base, rows, np.stack(speeds), stretch[rows])

    def errors(self, values: Values) -> F64:
        """Measured − predicted rim speeds, m/s, (2, n)."""
        told = wheel_speeds(self.record, summed(self.base, values), self.chassis)
        return np.asarray(self.chassis.radius_m * (self.measured - told[:, self.rows]))


@dataclass(frozen=True, eq=False)
class DriveFit:
    """Values of the drive's effects, and the cost of each stretch (S,)."""

    values: Values
    by_stretch: F64


def drive_of(
    problem: Problem, measured: Record, candidates: tuple[EffectDeclaration, ...], settings: DriveSettings
) -> Values:
    """The effects of the drive that the wheels need, with their values."""
    wheels = Wheels.of(problem, measured)
    current = fitted(wheels, {one.name: start_of(wheels, one) for one in candidates}, settings)
    while (lesser := needless(wheels, current, settings)) is not None:
        current = lesser
    return current.values


def needless(wheels: Wheels, current: DriveFit, settings: DriveSettings) -> DriveFit | None:
    """The fit without the first effect that it does not need, those that do least first; None without one."""

    def cost_without(name: str) -> float:
        return float(costs(wheels, without(current.values, name), settings).sum())

    for name in sorted(current.values, key=cost_without):
        lesser = fitted(wheels, without(current.values, name), settings)
        if not needed(lesser.by_stretch, current.by_stretch, settings):
            return lesser
    return None


def needed(without_it: F64, with_it: F64, settings: DriveSettings) -> bool:
    """Whether stretches (S,) are told clearly better with an effect: in sum and in most of them."""
    from scipy.stats import wilcoxon  # noqa: PLC0415 – half a second of start-up

    gained = without_it - with_it
    if gained.sum() < settings.least_better * with_it.sum():
        return False
    return bool(wilcoxon(gained, alternative="greater").pvalue < settings.level)


def without(values: Values, name: str) -> Values:
    """All values but those of one effect."""
    return {key: value for key, value in values.items() if key != name}


def start_of(wheels: Wheels, effect: EffectDeclaration) -> dict[str, float]:
    """Where a fit begins: absent; a limit where it begins to act, a delay and a lag of a few rows."""
    (key,) = effect.parameters
    rims = wheels.chassis.radius_m * np.stack([wheels.record.left_radps, wheels.record.right_radps])
    turning = np.abs(rims[1] - rims[0]) / (2 * wheels.chassis.half_track_m)
    starts = {
        "speed_saturation": float(np.quantile(np.abs(rims), 0.8)),
        "speed_desaturation": float(np.quantile(np.abs(rims), 0.8)),
        "turn_saturation": float(np.quantile(turning, 0.8)),
        "acceleration_limit": 2.0,
        "turn_acceleration_limit": 4.0,
        "actuator_lag": 0.2,
        "input_delay": 0.1,
        "speed_deadzone": 0.02,
    }
    return {key: starts.get(effect.name, 0.0)}


def fitted(wheels: Wheels, start: Values, settings: DriveSettings) -> DriveFit:
    """The best values of the effects of ``start``, robustly."""
    from scipy.optimize import least_squares  # noqa: PLC0415 – half a second of start-up

    which = [one for name in start for one in parameters_of(name)]
    if not which:
        return DriveFit(start, costs(wheels, start, settings))
    x0 = np.array([start[one.effect][one.key] for one in which])
    low = np.array([max(one.bounds[0], least_of(one)) for one in which])
    high = np.array([one.bounds[1] for one in which])

    def errors(x: F64) -> F64:
        return wheels.errors(named(which, x)).ravel()

    found = least_squares(
        errors,
        np.clip(x0, low, np.nextafter(high, low)),
        bounds=(low, high),
        loss="soft_l1",
        f_scale=settings.soft_mps,
        x_scale=np.maximum(np.abs(x0), settings.scale),
        diff_step=np.full(len(x0), 1e-3),
        max_nfev=settings.steps,
        ftol=settings.least_change,
        xtol=settings.least_change,
    )
    values = named(which, found.x)
    return DriveFit(values, costs(wheels, values, settings))


def least_of(which: Parameter) -> float:
    """The least value that a fit takes: a limit is never quite 0."""
    return 1e-3 if not DECLARED[which.effect].zero_is_absent else -np.inf


def named(which: list[Parameter], x: F64) -> Mapping[str, dict[str, float]]:
    """Values by effect and parameter."""
    return {one.effect: {one.key: float(value)} for one, value in zip(which, x, strict=True)}


def costs(wheels: Wheels, values: Values, settings: DriveSettings) -> F64:
    """Cost of each stretch (S,): soft absolute errors of both wheels."""
    each = np.sqrt(1 + (wheels.errors(values) / settings.soft_mps) ** 2) - 1
    return np.asarray(np.bincount(wheels.stretch, each.sum(axis=0), wheels.record.n_stretches), float)
