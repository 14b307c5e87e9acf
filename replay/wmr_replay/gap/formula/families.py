"""Families of terms with numbers: what a term is shaped by, times the factors that carry it."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.placed_factors import (
    Columns,
    bell_text,
    bump,
    edge,
    edge_text,
    hill,
    slanted_text,
    tilt,
    wave_text,
)
from wmr_schemas.shape_factors import OF_SHAPE, shape_text
from wmr_schemas.terms import Term, TermChannel

Factors = tuple[str, ...]
WAVES = ("sin", "cos")
BELLS = {"bump": bump, "hill": hill, "tilt": tilt}
SHAPES = ("fall", "over", "bell", "ring")
PLACED = ("wave", "bump", "hill", "tilt")


@dataclass(frozen=True)
class Family:
    """Terms of one form.

    ``kind`` is product, curve, wave, edge, bump, hill, tilt, or one of the shapes of
    :mod:`wmr_schemas.shape_factors`; it runs over ``along``. Each of its functions stands times each of the
    ``carriers``, which are products; with ``plain``, these stand beside them as well.
    """

    kind: str
    channel: TermChannel = "longitudinal"
    along: str = ""
    carriers: tuple[Factors, ...] = ((),)
    plain: bool = False

    def terms(self, shape: tuple[float, ...]) -> tuple[Term, ...]:
        """The terms with these numbers."""
        factors = texts(self.kind, self.along, shape)
        behind = self.kind in SHAPES
        shaped = tuple(
            Term(self.channel, (*carrier, factor) if behind else (factor, *carrier))
            for carrier in self.carriers
            for factor in factors
        )
        return (*shaped, *self.plain_terms)

    @property
    def plain_terms(self) -> tuple[Term, ...]:
        """Those of the terms that have no numbers."""
        return tuple(Term(self.channel, carrier or ("1",)) for carrier in self.carriers if self.plain)


def texts(kind: str, along: str, shape: tuple[float, ...]) -> tuple[str, ...]:
    """The factors of a kind: a wave has a sine and a cosine."""
    if kind == "wave" and along == "xy":
        return tuple(slanted_text(function, *shape) for function in WAVES)
    if kind == "wave":
        return tuple(wave_text(function, shape[0], along) for function in WAVES)
    if kind in BELLS:
        return (bell_text(kind, *shape),)
    if kind == "edge":
        return (edge_text(along, *shape),)
    return (shape_text(kind, along, *shape),)


def values(kind: str, along: str, shapes: F64, columns: Columns) -> F64:
    """The functions (n, m, 1), of a wave (n, m, 2), with each of the numbers ``shapes`` (m, k)."""
    own = {name: column[:, None] for name, column in columns.items()}
    if kind == "wave":
        names = tuple(along) if along == "xy" else (along,)
        phase = np.sum([k * own[name] for k, name in zip(shapes.T, names, strict=True)], axis=0)
        return np.stack([np.sin(phase), np.cos(phase)], axis=2)
    if kind in BELLS:
        return BELLS[kind](own, *shapes.T)[:, :, None]
    if kind == "edge":
        return edge(own[along], *shapes.T)[:, :, None]
    return np.asarray(OF_SHAPE[kind][0](own[along], *shapes.T))[:, :, None]
