"""Did the answer change? Tables against stored references, summaries against criteria, two results."""
