"""Families of terms with numbers: what a term is shaped by, times the factors that carry it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.placed_factors import (
    OF_LINE,
    Columns,
    away,
    band,
    bell_text,
    bump,
    circle,
    cut_text,
    disc,
    edge,
    hill,
    line_text,
    rope,
    rope_left,
    slanted_text,
    tilt,
    wave_text,
)
from wmr_schemas.shape_factors import OF_SHAPE, quantity, shape_text
from wmr_schemas.terms import Term, TermChannel

Factors = tuple[str, ...]
WAVES = ("sin", "cos")
CUTS = {"edge": edge, "band": band}
ROPES = {"rope": rope, "rope_left": rope_left}
BELLS: dict[str, Callable[..., F64]] = {
    "bump": bump,
    "disc": disc,
    "away": away,
    "circle": circle,
    "hill": hill,
    "tilt": tilt,
    **ROPES,
}
WIDE = ("away", *ROPES)
"""Bells that may be as wide as the area without terms beside them."""
SHAPES = ("fall", "over", "bell", "rise", "soft", "ring", "beyond", "above")
PLACED = ("wave", "bump", "disc", "away", "circle", "hill", "tilt", *ROPES, "band", "strip")


@dataclass(frozen=True)
class Family:
    """Terms of one form.

    ``kind`` is product, curve, wave, edge, band, side, strip, bump, disc, away, circle, hill, tilt, rope,
    rope_left, or one of the shapes of :mod:`wmr_schemas.shape_factors`; it runs over ``along``. Each of its
    functions stands times each of the ``carriers``, which are products; with ``plain``, these stand beside
    them as well. The numbers of a side or strip are its distance from ``around``, the angle across it, and
    its width.
    """

    kind: str
    channel: TermChannel = "longitudinal"
    along: str = ""
    carriers: tuple[Factors, ...] = ((),)
    plain: bool = False
    around: tuple[float, float] = (0.0, 0.0)

    def terms(self, shape: tuple[float, ...]) -> tuple[Term, ...]:
        """The terms with these numbers."""
        factors = texts(self, shape)
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


def swings_alone(family: Family) -> bool:
    """Whether a wave over time carries nothing but itself: such ones are looked for that are shorter."""
    return family.carriers == ((),)


def texts(family: Family, shape: tuple[float, ...]) -> tuple[str, ...]:
    """The factors of a family: a wave has a sine and a cosine."""
    kind, along = family.kind, family.along
    if kind == "wave" and along == "xy":
        return tuple(slanted_text(function, *shape) for function in WAVES)
    if kind == "wave":
        return tuple(wave_text(function, shape[0], along) for function in WAVES)
    if kind in BELLS:
        return (bell_text(kind, *shape),)
    if kind in OF_LINE:
        x, y, angle, width = map(float, line_of(family, np.array(shape)))
        return (line_text(kind, x, y, angle, width),)
    if kind in CUTS:
        return (cut_text(kind, along, *shape),)
    return (shape_text(kind, along, *shape),)


def line_of(family: Family, shapes: F64) -> tuple[F64, F64, F64, F64]:
    """Place, angle and width of sides or strips: the line's point that is nearest to the family's middle."""
    apart, angle, width = shapes.T
    (x, y), across = family.around, (np.cos(angle), np.sin(angle))
    return x + apart * across[0], y + apart * across[1], angle, width


def values(family: Family, shapes: F64, columns: Columns) -> F64:
    """The functions (n, m, 1), of a wave (n, m, 2), with each of the numbers ``shapes`` (m, k)."""
    kind, along = family.kind, family.along
    own = {name: column[:, None] for name, column in columns.items()}
    if kind == "wave":
        names = tuple(along) if along == "xy" else (along,)
        phase = np.sum([k * own[name] for k, name in zip(shapes.T, names, strict=True)], axis=0)
        return np.stack([np.sin(phase), np.cos(phase)], axis=2)
    if kind in BELLS:
        return BELLS[kind](own, *shapes.T)[:, :, None]
    if kind in OF_LINE:
        return OF_LINE[kind](own, *line_of(family, shapes))[:, :, None]
    if kind in CUTS:
        return CUTS[kind](own[along], *shapes.T)[:, :, None]
    return np.asarray(OF_SHAPE[kind][0](quantity(own, along), *shapes.T))[:, :, None]
