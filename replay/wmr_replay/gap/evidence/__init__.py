"""The gates that an effect must pass: significance, held-out proof, placebo, excitation."""
