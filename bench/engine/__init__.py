"""Logs of MuJoCo, an engine with contact and friction that shares nothing with the product.

``robots`` holds MJCF files; ``effects`` the engine's own mechanism of each hidden effect; ``drive`` the
closed loop; ``logs`` the measured log of a case and the base model, which ``fit`` calibrates on another log
of the same robot without the effect. ``accepted.toml`` and ``split.toml`` were committed before any log was
scored.
"""
