"""Options from files: --config FILE, a result's own settings, and the project's file."""
