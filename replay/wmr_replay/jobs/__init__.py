"""A log in, files out: run, gap, fit, convert."""
