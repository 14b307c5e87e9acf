"""Benchmark worlds: six driver families on two plants, an oracle and scores.

Nothing here belongs to the product. The second plant and the oracle are written from the model's equations
and from the declared formulas of the effects; they share no code with the analysis.
"""
