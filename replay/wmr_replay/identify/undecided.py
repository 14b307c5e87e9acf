"""No identifier: for replays that are asked for the data's quality alone."""

import numpy as np

from wmr_replay.identify.interface import Evidence, Verdict, no_posterior
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.status import Status


class Undecided:
    """Stage: evidence in, and for each row a verdict that leaves everything open."""

    def push(self, evidence: Evidence) -> Verdict:
        """See :class:`~wmr_replay.identify.interface.Identifier`."""
        n = len(evidence.t_ns)
        unknown = np.full(n, np.nan)
        return Verdict(
            c_d_mps2=unknown,
            c_k_threshold_mps=unknown,
            c_d_threshold_mps2=unknown,
            posterior=no_posterior(n),
            alpha=unknown,
            alpha_sd=unknown,
            mode=np.full(n, ContactMode.UNDECIDED, np.int8),
            mode_set=np.full(n, ModeSet.ALL_SINGLE, np.uint8),
            outcome=np.full(n, Status.OK, np.int8),
        )
