"""A binned log split into fitted and held-out rows, and the likelihood of an extended model on it."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from wmr_replay.gap.estimation.filter import FilterInput, FilterOutput, filter_pass
from wmr_replay.gap.estimation.lanes import Lane, filter_lanes
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS, SensitivityTargets, n_columns
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import N_STATE, Base, V, W
from wmr_replay.gap.model.extension import Extension, Parameters
from wmr_replay.gap.model.recent import Recent
from wmr_replay.gap.model.work import work_on
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled.lanes import WIDTH
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.signals import ModeTrack

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Problem:
    """``train`` (n,) marks the fitted rows: all but the last 4 s of every 12 s (``settings.split``), or with
    :meth:`all_fitted` every row.

    ``first`` (9,) is a rough state of row 0, with w still as a yaw rate; the split starts at ``shift_s``.
    """

    binned: BinnedLog
    train: Bool
    first: F64
    shift_s: float = 0.0

    @classmethod
    def of(cls, binned: BinnedLog, shift_s: float = 0.0) -> "Problem":
        """The split at fixed times, ``shift_s`` later."""
        split = binned.settings.split
        phase = (binned.t_s - shift_s) % split.period_s
        return cls(binned, phase < split.period_s - split.held_out_s, first_state(binned), shift_s)

    @property
    def settings(self) -> GateSettings:
        """The settings that the log was binned with."""
        return self.binned.settings

    def finer(self) -> "Problem":
        """The same split over bins of half the length."""
        return self.with_binned(self.binned.finer())

    def relabelled(self, track: ModeTrack) -> "Problem":
        """The same split with other contact modes, known as well as these."""
        return self.with_binned(self.binned.relabelled(track))

    def with_binned(self, binned: BinnedLog) -> "Problem":
        """The same split of another form of the log."""
        other = Problem.of(binned, self.shift_s)
        return other.all_fitted() if np.all(self.train) else other

    def fold(self, k: int) -> "Problem":
        """The split that holds out the ``k``-th part after this one's; every third one is the same."""
        return Problem.of(self.binned, self.shift_s + k * self.settings.split.held_out_s)

    def all_fitted(self) -> "Problem":
        """The same log with every row fitted."""
        return replace(self, train=np.ones(len(self.binned), bool))

    def under(self, settings: GateSettings) -> "Problem":
        """The same rows with other settings of the filter."""
        return replace(self, binned=replace(self.binned, settings=settings))

    def middle(self, n: int) -> "Problem":
        """The ``n`` rows in the middle of the log, fitted and held out as here."""
        return self.part(slice((len(self.binned) - n) // 2, (len(self.binned) + n) // 2))

    def part(self, rows: slice) -> "Problem":
        """Some of the rows, fitted and held out as here."""
        binned = self.binned.part(rows)
        return Problem(binned, self.train[rows], first_state(binned), self.shift_s)

    @cached_property
    def fitted(self) -> Bool | slice:
        """The fitted rows: ``train``, or where that is all of them, a slice, which copies nothing."""
        return slice(None) if np.all(self.train) else self.train

    @cached_property
    def variances(self) -> F64:
        """Measurement variance of each bin (n, 3), from the data alone and before anything is fitted."""
        return self.binned.variances

    def filtered(
        self,
        extension: Extension,
        noise: Diffusion,
        targets: SensitivityTargets = NO_TARGETS,
        *,
        keep: bool = False,
    ) -> FilterOutput:
        """The filter over the whole log; sums over ``train`` leave the held-out rows out.

        With ``keep``, the output holds the states and the sensitivities to ``targets``.
        """
        if keep:
            return self._filtered(extension, noise, targets, keep=True)
        kept: Recent[FilterOutput] = self.binned.passes
        return kept.get((identity_of(extension), noise), lambda: self._filtered(extension, noise, targets))

    def filtered_each(self, models: Sequence[tuple[Extension, Diffusion]]) -> list[FilterOutput]:
        """:meth:`filtered` with each model and noise, which share their base; several passes at once."""
        kept: Recent[FilterOutput] = self.binned.passes
        keys = [(identity_of(extension), noise) for extension, noise in models]
        missing = {key: model for key, model in zip(keys, models, strict=True) if key not in kept}
        new = dict(zip(missing, self._in_lanes(list(missing.values())), strict=True))

        def output(key: tuple[Hashable, Diffusion], model: tuple[Extension, Diffusion]) -> FilterOutput:
            return kept.get(key, lambda: new[key] if key in new else self._filtered(*model))

        return [output(key, model) for key, model in zip(keys, models, strict=True)]

    def _in_lanes(self, models: list[tuple[Extension, Diffusion]]) -> list[FilterOutput]:
        """A pass with each model and noise; one that is left over, or of other poses, by itself."""
        if any(extension.own for extension, _ in models):
            return [self._filtered(*model) for model in models]
        found: list[FilterOutput] = []
        for k in range(0, len(models), WIDTH):
            part = models[k : k + WIDTH]
            if len(part) == 1:
                found.append(self._filtered(*part[0]))
                continue
            self.worked(self.settings.work.of_lane * len(part))
            lanes = [Lane(self._rows(extension), extension.theta(), noise) for extension, noise in part]
            base = part[0][0].base
            first, settings = self._first(base), self.settings.filter
            found += filter_lanes(lanes, self.binned.pose, self.variances, first, base, settings)
        return found

    def worked(self, passes: float) -> None:
        """Count work that takes as long as ``passes`` of the filter over these rows."""
        work_on(self.binned.log.pose).add(passes * len(self.binned))

    def _rows(self, extension: Extension) -> F64:
        """Input rows (n, 16) of an extended model."""
        return self.binned.inputs.get(extension.of_rows, lambda: extension.rows(self.binned))

    def _first(self, base: Base) -> F64:
        """The rough state of row 0 (9,), with w = l·yaw_rate."""
        first = self.first.copy()
        first[W] *= base.half_track_m
        return first

    def _filtered(
        self,
        extension: Extension,
        noise: Diffusion,
        targets: SensitivityTargets = NO_TARGETS,
        *,
        keep: bool = False,
    ) -> FilterOutput:
        """:meth:`filtered` where the pass is not kept."""
        return self._filtered_rows(extension, self._rows(extension), noise, targets, keep=keep)

    def _filtered_rows(
        self,
        extension: Extension,
        rows: F64,
        noise: Diffusion,
        targets: SensitivityTargets = NO_TARGETS,
        *,
        keep: bool = False,
    ) -> FilterOutput:
        """:meth:`filtered` with other input rows (n, 16) than the extended model's."""
        first = self._first(extension.base)
        data = FilterInput(rows, extension.poses(self.binned), self.variances, first)
        settings = self.settings.filter
        self.worked(1.0 + self.settings.work.of_column * n_columns(targets))
        return filter_pass(data, extension.theta(), extension.base, noise, targets, settings, keep)

    def fitted_once(self, of: Hashable, fit: Callable[[], T]) -> T:
        """What ``fit`` finds on the fitted rows, and on these alone; known where ``of`` was fitted before.

        A search comes back to the same model with the same candidate many times.
        """
        found: T = self.binned.fits.get((self.train.tobytes(), self.shift_s, of), fit)
        return found

    def deviance(self, extension: Extension, noise: Diffusion) -> float:
        """−2 log likelihood of the fitted rows."""
        return float(self.filtered(extension, noise).deviance[self.train].sum())

    def innovations_of_rows(self, extension: Extension, rows: F64, noise: Diffusion) -> F64:
        """Whitened innovations (n, 3) with other input rows (n, 16) than the extended model's."""
        return self._filtered_rows(extension, rows, noise).innovations


def identity_of(extension: Extension) -> Hashable:
    """What the motion of an extended model follows from."""

    def of(name: str, parameters: Parameters) -> Hashable:
        return name, tuple(parameters.items())

    known = tuple(of(*effect) for effect in extension.known)
    new = tuple(of(*effect) for effect in extension.effects.items())
    return extension.base, extension.wheel_radius_m, extension.freedoms, known, new


def first_state(binned: BinnedLog) -> F64:
    """Pose of the first bin, and speeds by least squares over the first 0.4 s (w still as yaw rate). Raises
    InvalidSignal where a hole follows the first bin.
    """
    head = binned.t_s <= binned.t_s[0] + binned.settings.split.start_s
    if not head[1:].any():
        hole_s = binned.t_s[1] - binned.t_s[0]
        raise InvalidSignal(
            "pose", f"a hole of {hole_s:.3g} s follows the first ones: leave these out (start)"
        )
    slopes = np.polyfit(binned.t_s[head] - binned.t_s[0], binned.pose[head], 1)
    z = np.zeros(N_STATE)
    z[:3] = slopes[1]
    z[V] = slopes[0, 0] * np.cos(z[2]) + slopes[0, 1] * np.sin(z[2])
    z[W] = slopes[0, 2]
    return z
