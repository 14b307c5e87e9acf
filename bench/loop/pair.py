"""A pair of logs of one robot, and the two base models that they are judged with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_schemas.arrays import F64, I8
from wmr_schemas.model_file import Model
from wmr_schemas.signals import Log, ModeTrack

SETTLED_S = 2.0


@dataclass(frozen=True, eq=False)
class Pair:
    """``fitted`` is the log that ``gap`` sees, ``other`` the one that only ``run`` sees.

    ``analyse`` is the analysis of ``fitted``; ``mode`` (n,) the true modes at the other's poses, ``t_s`` (n,)
    their times; ``true`` the model with the hidden effect itself; ``evidence`` what ``run`` is asked for.
    ``modes`` are the true modes as a track, where the model is simulated forward too.
    """

    fitted: Log
    other: Log
    base: Model
    true: Model
    mode: I8
    t_s: F64
    evidence: str
    analyse: Callable[[Log, Model], Any]
    modes: ModeTrack | None = None

    @property
    def counted(self) -> F64:
        """Rows that are scored."""
        return np.asarray(self.t_s >= SETTLED_S)
