"""What each command prints, one module a command, and the progress bars."""
