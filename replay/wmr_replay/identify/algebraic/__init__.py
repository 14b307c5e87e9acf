"""Identifier ``algebraic``: windows that start at the switches, and a sequential test between them.

The paper's differentiator with κ = μ = 0 is the least-squares fit of a polynomial on a window of fixed
length; it averages over whatever mode the window holds. Here every window starts at a supposed switch and
grows until the next one, and the fit is of the mode's own equations, which are linear in few unknowns: the
motion, α, the yaw gain, and what the mode leaves free
(:mod:`~wmr_replay.identify.algebraic.regression`). Hypotheses about when the mode switched
(:mod:`~wmr_replay.identify.algebraic.branches`) are weighed by the likelihood of the poses under these fits:
a Bayesian sequential test (:mod:`~wmr_replay.identify.algebraic.filter`). It needs torques and pose alone,
neither a stiffness nor a mass. The differentiator's own estimates serve for C_k, C_d, their bands, and for
saying why something cannot be seen.

Sources: Yu, Barbot, Floquet (2009), §3.4 and §4, for the constraints; Fliess, Sira-Ramírez (2003) for
estimation by linear identities on windows that restart; Fearnhead, Liu (2007) for on-line inference over
change points.
"""

from wmr_replay.identify.algebraic.identifier import AlgebraicIdentifier, AlgebraicSettings
from wmr_replay.identify.algebraic.priors import Priors, make_priors

__all__ = ["AlgebraicIdentifier", "AlgebraicSettings", "Priors", "make_priors"]
