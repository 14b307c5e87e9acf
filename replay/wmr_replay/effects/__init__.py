"""The analysis's form of every effect: pure functions, each formula once.

The gap analysis, the identifiers and a replay with a model file use these same functions; the simulator has
forms of its own. What an effect is called, and within what bounds it is looked for, its declaration in
``wmr_schemas.effects`` says.

``theta``        where each parameter stands in the vector θ
``motion``       accelerations, and torque lost at a wheel
``response``     α, α_yaw and tyre stiffness
``efforts``      torques as they act
``measurement``  the pose as measured
``local``        effects in a stretch of time or a region
``own``          effects that users add
"""
