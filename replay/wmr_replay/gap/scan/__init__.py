"""One filter pass scores every candidate effect: sensitivities, normal equations, ranked candidates."""
