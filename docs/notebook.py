# %% [markdown]
# # In Python
#
# A synthetic log is made, replayed, looked at and measured against its truth, without a file being written. The page
# is made from `docs/notebook.py`, a script with cells: editors such as VS Code and Jupyter (with jupytext) open it as a
# notebook, and `python docs/make_notebook.py` executes it and writes this page.

# %%
import numpy as np
import polars as pl

import wmr_replay as wr

# %% [markdown]
# ## A log and its replay
#
# A robot drives for a minute and changes speed, turning and contact mode at random; its pose has the noise of a
# satellite receiver with corrections, 1 cm and 5 mrad. `synthesise` returns signals in memory, as arrays:

# %%
made = wr.synthesise("random", seed=8, duration_s=60, noise="rtk")
made.log.pose.x_m[:4], made.log.torque.left_nm[:4]

# %% [markdown]
# `replay` takes such signals; `wr.run("log.mcap")` does the same with a file or a URL. The result shows itself:

# %%
result = wr.replay(made.log, name="random drive")
result

# %%
result.plot()

# %% [markdown]
# On the left is the measured path in the colour of the mode that was estimated there. On the right are, from the top,
# the estimated and the true mode, the velocities, the two constraints with the bands that noise alone explains, and α
# with its 95 % interval; the background has the colour of the estimated mode, white where the robot rolls ideally. The
# estimate trails the truth by the detection delay: every row depends on what was known at its time.

# %% [markdown]
# ## Tables
#
# Every answer is a polars frame, with modes by name.

# %%
result.segments.select("start_s", "end_s", "mode", "mean_p", "alpha", "alpha_sd").head(6)

# %%
result.confusion.pivot("mode", index="mode_true", values="seconds")

# %% [markdown]
# Samples are lazy: choose rows and columns first, then `collect`. How large does C_k get in each mode?

# %%
(
    result.samples.filter(pl.col("status") == "ok")
    .group_by("mode")
    .agg(pl.len(), pl.col("c_k_mps").abs().quantile(0.95).round(3).alias("|C_k|, 95 %"))
    .sort("mode")
    .collect()
)

# %% [markdown]
# ## Which identifier?
#
# Settings are keyword arguments. The paper's thresholds against the two identifiers that weigh hypotheses:

# %%
rows = [
    wr.replay(made.log, identifier=name).summary.select(
        pl.lit(name).alias("identifier"),
        pl.col("accuracy", "median_detection_delay_s", "missed_switches").round(3),
    )
    for name in ("paper", "algebraic", "bank")
]
pl.concat(rows)

# %% [markdown]
# ## Derivatives of any signal
#
# The differentiator also serves by itself. Its estimates describe the instants `at_s`, half a window behind, and carry a
# standard deviation that follows the noise of the signal.

# %%
rng = np.random.default_rng(0)
t = np.arange(0, 6, 0.01)
signal = np.sin(2 * t) + 0.3 * np.sin(7 * t)
measured = signal + 0.01 * rng.standard_normal(len(t))
speed = wr.differentiate(t, measured, order=1, max_delay_s=0.1)
truth = 2 * np.cos(2 * speed.at_s) + 2.1 * np.cos(7 * speed.at_s)
error = speed.value - truth
print(f"window {speed.window_s:.2f} s, delay {speed.delay_s:.2f} s, noise found {speed.noise_sd[0]:.4f}")
print(f"rms error {np.sqrt(np.nanmean(error**2)):.3f}, of which noise {np.nanmean(speed.sd):.3f}")

# %%
from matplotlib.figure import Figure

blue = "#346c8c"
figure = Figure(figsize=(9, 4.6), layout="constrained")
above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
above.plot(speed.at_s, speed.value, color=blue, linewidth=2, label="estimate")
above.plot(speed.at_s, truth, color="0.2", linewidth=1, linestyle="--", label="truth")
below.fill_between(speed.at_s, -2 * speed.sd, 2 * speed.sd, color=blue, alpha=0.2, label="± 2 sd")
below.plot(speed.at_s, error, color=blue, linewidth=1, label="error")
above.set(title="First derivative [1/s]", xlim=(0, 6))
below.set(title="Error [1/s]", xlabel="instant described [s]")
for axes in (above, below):
    axes.title.set(fontweight="bold", fontsize=10, horizontalalignment="left", x=0)
    axes.legend(ncols=2, loc="lower right", bbox_to_anchor=(1, 0.98), frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e6e8ec")
figure

# %% [markdown]
# ## Files
#
# Files appear where you say. A log written to disk is opened, looked into, and replayed; `save` writes exactly what
# `wmr-replay run --out` writes.

# %%
made.save("drive.mcap")
log = wr.open_log("drive.mcap")
info = log.info()
print(f"{info.n_messages} messages in {info.duration_s:.0f} s; pose on {info.used['pose']['topic']}")
log.signals().torque.head(3)

# %%
files = wr.run("drive.mcap").save("results")
sorted(path.name for path in files.values())

# %% [markdown]
# ## Two results
#
# What does another setting change? `compare` takes results, logs and directories.

# %%
comparison = wr.compare(result, wr.replay(made.log, identifier="paper", name="thresholds"))
print(f"another mode in {comparison.other_mode_share:.1%} of the rows")
comparison.summary.filter(pl.col("field").str.contains("recall|alarms|delay")).with_columns(
    pl.col("a", "b", "delta").round(3)
)
