"""The result of a gap analysis, assembled from a selection."""
