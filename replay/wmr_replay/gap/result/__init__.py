"""What a gap analysis says, put together from a selection."""
