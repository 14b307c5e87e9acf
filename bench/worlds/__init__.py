"""Benchmark worlds: ten driver families on three plants, an oracle and scores.

Nothing here belongs to the product. The second plant, the third and the oracle are written from the model's
equations and from the declared formulas of the effects; they share no code with the analysis.
"""
