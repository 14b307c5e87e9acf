"""Compiled functions: how they are compiled and cached, and what of numba's internals they use."""
