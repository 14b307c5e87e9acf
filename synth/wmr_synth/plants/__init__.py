"""Simulated robots: equations of motion and the compiled loops that integrate them."""
