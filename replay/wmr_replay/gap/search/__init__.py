"""The search: candidates fitted, forward selection, backward elimination, contact modes."""
