"""What ``design`` prints: the figures of a differentiator, and what it makes of a log."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.table import Table

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import output_width, print_table
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_schemas.text import figure

if TYPE_CHECKING:
    from wmr_replay.api.design import Design
    from wmr_replay.api.pose_derivatives import PoseDerivatives


def print_design(design: "Design", on_log: "PoseDerivatives | None", *, as_json: bool) -> None:
    """The figures of every order, then those of the log; or all of it as JSON."""
    if as_json:
        echo_json(design.as_dict() | ({} if on_log is None else {"log": on_log.as_dict()}))
        return
    console, spec = console_of(width=output_width()), design.spec
    shares = "".join(f", share {share:g}" for share in spec.shares)
    console.print(
        styled(
            (
                f"N = {spec.degree}, kappa = {spec.kappa}, mu = {spec.mu}, theta = {spec.theta:g}{shares}",
                "bold",
            ),
            f"  window {design.window_s:.4g} s, {design.taps.shape[1]} taps",
            f" at {figure(design.rate_hz, 5)} Hz",
            ", delay ",
            (f"{design.delay_s:.4g} s", "bold"),
        )
    )
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for name in (
        "order",
        "c",
        f"sd at noise {design.sigma:g}",
        "efficiency, N",
        "N + 1",
        "-3 dB, Hz",
        "delay at root, s",
    ):
        table.add_column(name, justify="right", no_wrap=True)
    for row in design.orders:
        at_root = design.window_s * (1 - row.root_theta) / 2
        cells = (
            row.noise_coefficient,
            row.sd,
            row.efficiency,
            row.efficiency_next,
            row.bandwidth_hz,
            at_root,
        )
        table.add_row(str(row.order), *(figure(cell) for cell in cells))
    print_table(console, table, n_titles=0)
    for line in () if on_log is None else log_lines(on_log):
        console.print(line)


def log_lines(found: "PoseDerivatives") -> Iterator[str]:
    """Rows, noise and size of the derivatives of a log, and the advice of ``tune``."""
    yield (
        f"\n{found.n_rows} rows, {share(found.n_ok, found.n_rows)} with an estimate, "
        f"{share(found.n_gap, found.n_rows)} behind a gap, coverage {found.mean_coverage:.3f}"
    )
    for s in found.signals:
        first, second = (f"{rms:.3g} ± {sd:.3g}" for rms, sd in zip(s.rms, s.sd, strict=True))
        yield (
            f"{s.name:4}noise {s.sigma:.3g} {s.unit}; rms of the first derivative {first} {s.unit}/s, "
            f"of the second {second} {s.unit}/s²"
        )
    for result in found.advice:
        yield f"\nx, order {result.order}: expected error (noise and bias) on the log's first rows"
        for e in (result.choice, result.butterworth, result.kalman):
            if e is not None:
                yield f"  {e.rmse:8.3g} ({e.sd:.2g}, {e.bias:.2g}) at {e.delay_s:.3g} s: {e.label}"


def share(part: int, whole: int) -> str:
    """As per cent."""
    return f"{100 * part / max(whole, 1):.1f} %"
