"""Scores of thousands of groups of terms at once, by the filter's answer to short pushes.

The innovations are linear in a small acceleration u, ψ = L u. One pass with pushes of a few rows, as many
apart as an answer lasts, gives all columns of L: within a stretch of that length, the answer to pushes of the
stretch and of the one before it. So for every stretch i, with M its answers to (u_(i−1), u_i),

    G = Σ (u_(i−1), u_i)ᵀ MᵀM (u_(i−1), u_i) = Σ u_iᵀ(D_i u_i + 2 E_iᵀ u_(i−1)),   s = Σ (u_(i−1), u_i)ᵀ Mᵀe,

D the blocks of MᵀM that two stretches have in common, E what is between them, and a group costs as much as a
small matrix product. Terms without numbers are the same in all groups of a grid, and their product is made
once. Values are taken at the middle of each push, and of a long log some of the stretches are looked at: what
is best here is scored anew with the filter itself, on all rows.
"""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple
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
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.terms import Term, TermChannel

Known = dict[tuple[object, ...], F64]
SHAPES_AT: WeakKeyDictionary[BinnedLog, Known] = WeakKeyDictionary()
"""The shapes and carriers of the logs that are analysed, which every screen reads."""


class Columns(NamedTuple):
    """Groups of m times w columns that have numbers (I, B, w, m), and c that all have in common (I, B, c)."""

    shaped: F64
    plain: F64


@dataclass(frozen=True, eq=False)
class Answers:
    """Of one channel, for each of I stretches of B pushes: D and 2 Eᵀ (I, B, 2B), Mᵀe (I, B, q) and
    Mᵀ·nuisance (I, B, r); and over all of them the nuisance's own products (r, r), and those with e (r, q).

    ``stretches`` (I,) are those of the log, and a sum over them is ``share`` of that over all.
    """

    stretches: I64
    share: float
    H: F64
    by_e: F64
    by_nuisance: F64
    nuisance: F64
    nuisance_e: F64

    def pushed(self, columns: F64) -> F64:
        """D_i u_i + 2 E_iᵀ u_(i−1) (I·B, k) of columns u (I, B, k)."""
        before = np.zeros_like(columns)
        before[1:] = columns[:-1]
        return merged(self.H @ np.concatenate([columns, before], axis=1))

    def equations(self, columns: Columns) -> tuple[F64, F64]:
        """S (m, w + c, q) and G (m, w + c, w + c) of groups of columns, the nuisance projected out."""
        *size, w, m = columns.shaped.shape
        shaped, plain = columns.shaped.reshape(*size, w * m), columns.plain
        by_shaped, by_plain = self.pushed(shaped), self.pushed(plain)
        shaped, plain = merged(shaped), merged(plain)
        c = plain.shape[1]
        G = np.empty((m, w + c, w + c))
        for a, b in product(range(w), repeat=2):
            one, other = (flat.reshape(-1, w, m) for flat in (shaped, by_shaped))
            G[:, a, b] = np.einsum("rm,rm->m", one[:, a], other[:, b])
        G[:, :w, w:] = by_group(shaped.T @ by_plain, w)
        G[:, w:, :w] = by_group(by_shaped.T @ plain, w).transpose(0, 2, 1)
        G[:, w:, w:] = plain.T @ by_plain
        G = (G + G.transpose(0, 2, 1)) / 2
        s = along(shaped, plain, self.by_e, w)
        if self.nuisance.size:
            cross = along(shaped, plain, self.by_nuisance, w)
            s = s - cross @ np.linalg.solve(self.nuisance, self.nuisance_e)
            G = G - np.einsum("mar,mbr->mab", cross @ np.linalg.inv(self.nuisance), cross)
        return s, G


def merged(values: F64) -> F64:
    """Values (I, B, k) as (I·B, k)."""
    return values.reshape(values.shape[0] * values.shape[1], values.shape[2])


def by_group(products: F64, w: int) -> F64:
    """Products (w·m, k) as (m, w, k)."""
    return products.reshape(w, len(products) // w, products.shape[1]).transpose(1, 0, 2)


def along(shaped: F64, plain: F64, values: F64, w: int) -> F64:
    """Products (m, w + c, k) of groups' columns (n, w·m) and (n, c) with values (I, B, k)."""
    flat = merged(values)
    of_shaped, of_plain = by_group(shaped.T @ flat, w), plain.T @ flat
    return np.concatenate([of_shaped, np.broadcast_to(of_plain, (len(of_shaped), *of_plain.shape))], axis=1)


@dataclass(frozen=True, eq=False)
class Screen:
    """The answers of both channels at a model, of all stretches and of some, and the log's columns (I, B) at
    the pushes.
    """

    answers: dict[TermChannel, Answers]
    of_some: dict[TermChannel, Answers]
    columns: dict[str, F64]
    known: Known

    def gains(self, grid: Grid) -> F64:
        """λ (m, q) of a grid's groups; a gust may lie in any stretch."""
        local = any(family.kind in ("gust", "pulse") for family, _ in grid.pieces)
        answers = (self.answers if local else self.of_some)[grid.first.channel]
        s, G = answers.equations(self.of(grid, answers.stretches))
        seen = np.einsum("maa->ma", G)
        blind = seen.min(axis=1) <= 1e-6 * np.median(seen)
        G = G + 1e-6 * seen[:, :, None] * np.eye(G.shape[1])
        G[blind] = np.eye(G.shape[1])
        lam = np.einsum("maq,maq->mq", s, np.linalg.solve(G, s)) / answers.share
        return np.where(blind[:, None], 0.0, lam)

    def of(self, grid: Grid, stretches: I64) -> Columns:
        """The columns of a grid's groups in some stretches, as its family's terms."""
        family = grid.first
        key = (len(stretches), *((one.kind, one.along, numbers.tobytes()) for one, numbers in grid.pieces))
        if key not in self.known:
            flat = {name: column[stretches].ravel() for name, column in self.columns.items()}
            pieces = [values(one, numbers, flat) for one, numbers in grid.pieces]
            self.known[key] = np.concatenate(pieces, axis=1).transpose(0, 2, 1).astype(np.float32)
        shaped = self.known[key]
        carriers = np.stack([self.carrier(carrier, stretches) for carrier in family.carriers], axis=1)
        carried = carriers[:, :, None, None] * shaped[:, None]
        size, n_carriers = (len(stretches), len(carriers) // len(stretches)), carriers.shape[1]
        plain = carriers.reshape(*size, n_carriers)[:, :, : n_carriers if family.plain else 0]
        return Columns(carried.reshape(*size, -1, shaped.shape[2]), plain)

    def carrier(self, factors: Factors, stretches: I64) -> F64:
        """A product of factors at the pushes (I·B,)."""
        key = "carrier", factors, len(stretches)
        if key not in self.known:
            flat = {name: column[stretches].ravel() for name, column in self.columns.items()}
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
    n_stretches = -(-n // (own.push_rows * own.pushes))
    chosen = some_of(n_stretches, own)
    every, some = {}, {}
    for k, channel in enumerate(channels):
        answers = psi[:, :, k * own.pushes : (k + 1) * own.pushes]
        every[channel] = answers_of(answers, e, nuisance, np.ones(n_stretches, bool), own)
        whole = bool(chosen.all())
        some[channel] = every[channel] if whole else answers_of(answers, e, nuisance, chosen, own)
    known = SHAPES_AT.setdefault(problem.binned, {})
    return Screen(every, some, pushed_columns(problem.binned, n_stretches, own), known)


def some_of(n: int, own: FormulaSettings) -> Bool:
    """Which of n stretches are looked at (n,): all of them, or about ``most_stretches`` in runs all along."""
    run = own.stretches_in_a_row
    every = max(n // own.most_stretches, 1)
    return np.asarray((np.arange(n) // run) % every == 0)


def answers_of(psi: F64, e: F64, nuisance: F64, chosen: Bool, own: FormulaSettings) -> Answers:
    """The answers of one channel from those to its combs (n, 3, B), in the ``chosen`` stretches (I,)."""
    rows, B = own.push_rows * own.pushes, own.pushes
    late = (np.arange(rows)[:, None] // own.push_rows) >= np.arange(B)

    def tiled(values: F64) -> F64:
        whole = np.zeros((len(chosen) * rows, *values.shape[1:]))
        whole[: len(values)] = values
        return whole.reshape(len(chosen), rows, *values.shape[1:])[chosen]

    tiles = tiled(psi)
    M = np.concatenate(
        [np.where(late[:, None], 0.0, tiles), np.where(late[:, None], tiles, 0.0)], axis=3
    ).reshape(-1, rows * 3, 2 * B)
    flat, left = (tiled(values).reshape(len(M), rows * 3, -1) for values in (nuisance, e))
    across = M.transpose(0, 2, 1)
    products = np.einsum("irk,irl->kl", flat, flat)
    products = products + 1e-9 * np.diag(np.diag(products)) + 1e-12 * np.eye(len(products))
    read = chosen | np.append(chosen[1:], False)
    D, twice_E, by_e, by_nuisance = halves_joined(across @ M, across @ left, across @ flat, chosen)
    return Answers(
        np.flatnonzero(read),
        float(chosen.mean()),
        np.concatenate([D, twice_E], axis=2)[read].astype(np.float32),
        by_e[read].astype(np.float32),
        by_nuisance[read].astype(np.float32),
        products,
        np.einsum("irk,irq->kq", flat, left),
    )


def halves_joined(H: F64, by_e: F64, by_nuisance: F64, chosen: Bool) -> tuple[F64, F64, F64, F64]:
    """D and 2 Eᵀ (I, B, B), and Mᵀe and Mᵀ·nuisance by the stretch in which a push is, from MᵀM (k, 2B, 2B)
    and the others (k, 2B, ...) of the k ``chosen`` stretches and the pushes before and in them.
    """
    B, I = H.shape[1] // 2, len(chosen)

    def joined(before: F64, inside: F64) -> F64:
        found = np.zeros((I + 1, *inside.shape[1:]))
        found[1:][chosen] += inside
        found[:-1][chosen] += before
        return found[1:]

    twice_E = np.zeros((I, B, B))
    twice_E[chosen] = 2 * H[:, B:, :B]
    D = joined(H[:, :B, :B], H[:, B:, B:])
    of_e, of_nuisance = (joined(some[:, :B], some[:, B:]) for some in (by_e, by_nuisance))
    return D, twice_E, of_e, of_nuisance


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
