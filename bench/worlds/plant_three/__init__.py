"""A third plant, written for a report: tyres with relaxation lengths, friction shared between directions.

Its effects, sizes and sensors are those of the second plant; equations, forms, controller and integrator are
its own (``equations``).
"""
