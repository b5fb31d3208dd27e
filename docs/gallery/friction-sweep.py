"""Pressure on the flanks of a wedge

The pressing force on both flanks of the wedge over the coefficient of friction: twenty-one solves that share one
factored body. The more friction carries, the less the flanks press; where all of them slip, equilibrium determines
how much.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import bemkit as bk

scene = bk.load_scene(Path(__file__).with_name("wedge-in-groove.toml"))
table = bk.sweep(scene, {"law.friction_coefficient": [0.025 * k for k in range(21)]})
figure = Figure(figsize=(6.0, 4.0), layout="constrained")
axes = figure.subplots()
coefficient = table.column("law.friction_coefficient")
axes.plot(coefficient, table.column("force_normal"), "o", label="bemkit")
sine, cosine = 1.0 / np.sqrt(10.0), 3.0 / np.sqrt(10.0)  # of half the angle of the wedge
axes.plot(coefficient, 1.2 / (sine + coefficient * cosine), label="equilibrium")
axes.set(xlabel="friction coefficient", ylabel="pressing force on both flanks")
axes.legend()
