"""The likelihood of a model on a log: binned log, prediction-error filter, sensitivities, refit."""
