"""Options that several commands share, and what they say as arguments of the public functions."""
