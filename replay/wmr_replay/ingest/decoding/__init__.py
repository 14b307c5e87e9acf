"""Message encodings to columns: definitions, layouts, and compiled passes over messages built alike."""
