"""What is missing outside of the library: a formula of a few terms of a dictionary, through all gates."""
