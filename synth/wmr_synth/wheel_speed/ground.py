"""The ground under the wheels: dry floor, and slippery stretches under one or both sides."""

from dataclasses import dataclass, replace

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S


@dataclass(frozen=True, eq=False)
class Ground:
    """Coefficients of friction under the left and the right wheels, and what of them holds sideways, a share;
    held from their stamp (ns) on, (n,) each. Dry and slippery stretches take turns, a dry one comes first.
    """

    t_ns: I64
    left: F64
    right: F64
    sideways: F64

    def holding(self) -> "Ground":
        """The same slippery stretches, between which the ground holds any force."""
        dry = np.arange(len(self.t_ns)) % 2 == 0
        return replace(self, left=np.where(dry, np.inf, self.left), right=np.where(dry, np.inf, self.right))


@dataclass(frozen=True)
class Floor:
    """How often the ground is slippery, and how much; bounds of what is drawn, in s and as coefficients."""

    between_s: tuple[float, float] = (2.5, 8.0)
    length_s: tuple[float, float] = (2.0, 4.5)
    dry: tuple[float, float] = (0.5, 0.9)
    slippery: tuple[float, float] = (0.04, 0.22)
    sideways: tuple[float, float] = (0.15, 0.8)
    """Share of the grip that holds sideways on slippery ground: less on sand or wet grass than on ice."""
    one_side: float = 0.2
    """Share of the slippery stretches that are so under one side, the other has √(dry·slippery)."""
    uneven: float = 1.0
    """Slip by unevenness in that of an ordinary floor."""
    uneven_tau_s: float = 0.3
    """Correlation time of the unevenness."""

    def drawn(self, duration_s: float, rng: np.random.Generator) -> Ground:
        """A dry floor with stretches of wet or icy ground."""
        n = int(np.ceil(duration_s / (self.between_s[0] + self.length_s[0]))) + 1
        dry = float(rng.uniform(*self.dry))
        lengths = np.stack([rng.uniform(*self.between_s, n), rng.uniform(*self.length_s, n)], axis=1).ravel()
        wet = np.exp(rng.uniform(np.log(self.slippery[0]), np.log(self.slippery[1]), n))
        side = np.where(rng.uniform(0.0, 1.0, n) < self.one_side, rng.integers(1, 3, n), 0)
        starts_s = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        left, right = (
            np.stack([np.full(n, dry), np.where(side == spared, np.sqrt(dry * wet), wet)], axis=1).ravel()
            for spared in (1, 2)
        )
        across = np.stack([np.ones(n), rng.uniform(*self.sideways, n)], axis=1).ravel()
        kept = starts_s < duration_s
        t_ns = np.rint(starts_s[kept] * NS_PER_S).astype(np.int64)
        return Ground(t_ns, left[kept], right[kept], across[kept])


ICY = Floor()
HALL = Floor(between_s=(60.0, 240.0), length_s=(1.0, 3.0), slippery=(0.02, 0.2))
DRY = Floor(between_s=(1e6, 1e6))
