"""Scores of thousands of groups of terms at once, by the filter's answer to short pushes.

The innovations are linear in a small acceleration u, ψ = L u. One pass with pushes of a few rows, as many
apart as an answer lasts, gives all columns of L: within a stretch of that length, the answer to pushes of the
stretch and of the one before it. So for every stretch, with W = (u before, u in it),

    G = Σ Wᵀ(MᵀM)W,   s = Σ Wᵀ(Mᵀe),   M the answers of the stretch,

and a group costs as much as a small matrix product. Values are taken at the middle of each push: what is best
here is scored anew with the filter itself.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, clipped
from wmr_replay.gap.formula.families import Factors, values
from wmr_replay.gap.formula.grids import Grid
from wmr_replay.gap.formula.scores import sensitivities_to
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of, effort_change
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term, TermChannel

Known = dict[tuple[object, ...], F64]
SHAPES_AT: WeakKeyDictionary[BinnedLog, Known] = WeakKeyDictionary()
"""The shapes and carriers of the logs that are analysed, which every screen reads."""


@dataclass(frozen=True, eq=False)
class Answers:
    """Of one channel, for each of I stretches of B pushes: MᵀM (I, 2B, 2B), Mᵀe (I, 2B, q) and Mᵀ·nuisance
    (I, 2B, r); and over all of them the nuisance's own products (r, r), and those with e (r, q).
    """

    H: F64
    by_e: F64
    by_nuisance: F64
    nuisance: F64
    nuisance_e: F64

    def equations(self, columns: F64) -> tuple[F64, F64]:
        """S (m, w, q) and G (m, w, w) of groups of w columns (I, B, m, w), the nuisance projected out."""
        before = np.zeros_like(columns)
        before[1:] = columns[:-1]
        W = np.concatenate([before, columns], axis=1)
        I, B, m, w = W.shape
        flat = W.reshape(I, B, m * w)
        answered = (self.H @ flat).reshape(W.shape)
        G = np.empty((m, w, w))
        for a in range(w):
            for b in range(a + 1):
                G[:, a, b] = G[:, b, a] = np.einsum("irm,irm->m", W[..., a], answered[..., b])
        along = flat.reshape(I * B, m * w).T
        s = along @ self.by_e.reshape(I * B, -1)
        if self.nuisance.size:
            cross = along @ self.by_nuisance.reshape(I * B, -1)
            s = s - cross @ np.linalg.solve(self.nuisance, self.nuisance_e)
            cross = cross.reshape(m, w, -1)
            G = G - np.einsum("mar,mbr->mab", cross @ np.linalg.inv(self.nuisance), cross)
        return s.reshape(m, w, -1), G


@dataclass(frozen=True, eq=False)
class Screen:
    """The answers of both channels at a model, and the log's columns (I, B) at the pushes."""

    answers: dict[TermChannel, Answers]
    columns: dict[str, F64]
    known: Known

    def gains(self, grid: Grid) -> F64:
        """λ (m, q) of a grid's groups."""
        s, G = self.answers[grid.first.channel].equations(self.of(grid))
        seen = np.einsum("maa->ma", G)
        blind = seen.min(axis=1) <= 1e-6 * np.median(seen)
        G = G + 1e-6 * seen[:, :, None] * np.eye(G.shape[1])
        G[blind] = np.eye(G.shape[1])
        lam = np.einsum("maq,maq->mq", s, np.linalg.solve(G, s))
        return np.where(blind[:, None], 0.0, lam)

    def of(self, grid: Grid) -> F64:
        """The columns (I, B, m, w) of a grid's groups, as its family's terms."""
        family = grid.first
        key = tuple((one.kind, one.along, numbers.tobytes()) for one, numbers in grid.pieces)
        if key not in self.known:
            flat = {name: column.ravel() for name, column in self.columns.items()}
            pieces = [values(one.kind, one.along, numbers, flat) for one, numbers in grid.pieces]
            self.known[key] = np.concatenate(pieces, axis=1).astype(np.float32)
        shaped, size = self.known[key], self.columns["t"].shape
        carriers = [self.carrier(carrier) for carrier in family.carriers]
        parts = [shaped * carrier[:, None, None] for carrier in carriers]
        if family.plain:
            m = shaped.shape[1]
            parts += [np.broadcast_to(carrier[:, None, None], (len(carrier), m, 1)) for carrier in carriers]
        return np.concatenate(parts, axis=2).reshape(*size, shaped.shape[1], -1)

    def carrier(self, factors: Factors) -> F64:
        """A product of factors at the pushes (I·B,)."""
        key = "carrier", factors
        if key not in self.known:
            flat = {name: column.ravel() for name, column in self.columns.items()}
            self.known[key] = Term("yaw", factors or ("1",)).evaluate(flat).astype(np.float32)
        return self.known[key]


def screen_of(problem: Problem, at: Fit, e: F64, nuisance: F64) -> Screen:
    """The screen at a model, for innovations ``e`` (n, 3, q), clipped and 0 where rows are not fitted."""
    own, base = problem.settings.formula, at.extension.base
    push, n = np.arange(len(problem.binned)) // own.push_rows, len(problem.binned)
    combs = np.eye(own.pushes)[:, push % own.pushes]
    channels: tuple[TermChannel, ...] = ("longitudinal", "yaw")
    efforts = np.stack([effort_change(channel, comb, base) for channel in channels for comb in combs])
    psi, _ = sensitivities_to(problem, at, efforts)
    psi = np.where(problem.train[:, None, None], psi, 0.0)
    nuisance = np.where(problem.train[:, None, None], nuisance, 0.0)
    stretches = -(-n // (own.push_rows * own.pushes))
    answers = {
        channel: answers_of(psi[:, :, k * own.pushes : (k + 1) * own.pushes], e, nuisance, stretches, own)
        for k, channel in enumerate(channels)
    }
    known = SHAPES_AT.setdefault(problem.binned, {})
    return Screen(answers, pushed_columns(problem.binned, stretches, own), known)


def answers_of(psi: F64, e: F64, nuisance: F64, stretches: int, own: FormulaSettings) -> Answers:
    """The answers of one channel from those to its combs (n, 3, B)."""
    rows, B = own.push_rows * own.pushes, own.pushes
    late = (np.arange(rows)[:, None] // own.push_rows) >= np.arange(B)

    def tiled(values: F64) -> F64:
        whole = np.zeros((stretches * rows, *values.shape[1:]))
        whole[: len(values)] = values
        return whole.reshape(stretches, rows, *values.shape[1:])

    tiles = tiled(psi)
    M = np.concatenate(
        [np.where(late[:, None], 0.0, tiles), np.where(late[:, None], tiles, 0.0)], axis=3
    ).reshape(stretches, rows * 3, 2 * B)
    across = M.transpose(0, 2, 1)
    by_e = across @ tiled(e).reshape(stretches, rows * 3, e.shape[2])
    by_nuisance = across @ tiled(nuisance).reshape(stretches, rows * 3, nuisance.shape[2])
    flat = nuisance.reshape(3 * len(nuisance), nuisance.shape[2])
    products = flat.T @ flat
    products = products + 1e-9 * np.diag(np.diag(products)) + 1e-12 * np.eye(len(products))
    small = np.float32
    H = (across @ M).astype(small)
    return Answers(
        H, by_e.astype(small), by_nuisance.astype(small), products, flat.T @ e.reshape(len(flat), -1)
    )


def pushed_columns(binned: BinnedLog, stretches: int, own: FormulaSettings) -> dict[str, F64]:
    """The log's columns (I, B), averaged over each push; the last ones are repeated to fill the stretches."""
    n = stretches * own.pushes * own.push_rows
    rows = np.minimum(np.arange(n), len(binned) - 1).reshape(stretches, own.pushes, own.push_rows)
    return {name: column[rows].mean(axis=2) for name, column in columns_of(binned).items()}


def fitted_innovations(problem: Problem, innovations: F64) -> F64:
    """Innovations (n, 3), clipped where rows are fitted and 0 where they are not."""
    found = np.zeros_like(innovations)
    found[problem.train] = clipped(innovations[problem.train], problem.settings.refit)
    return found
