"""The extended model: dynamics, their Jacobians, inputs as they act, and the candidate effects."""
