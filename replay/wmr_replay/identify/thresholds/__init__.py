"""Identifier ``paper``: thresholds on C_k and C_d, and α by weighted regression."""
