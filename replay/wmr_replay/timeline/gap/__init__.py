"""A gap analysis as a Rerun recording."""
