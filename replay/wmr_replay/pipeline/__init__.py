"""The stages of a replay in their order, in memory: align, differentiate, identify."""
