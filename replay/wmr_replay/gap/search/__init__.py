"""Which effects may be missing: scan of the candidates, leads, selection, contact modes."""
