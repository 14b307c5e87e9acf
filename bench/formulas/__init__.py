"""Hidden accelerations that no effect of the library is, for the benchmark ``gap_formulas``."""
