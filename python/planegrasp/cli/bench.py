"""`planegrasp bench NAME`: the measurements that docs/benchmarks.md defines."""

from __future__ import annotations

import typer

from planegrasp.cli import bench_detection, bench_systems

app = typer.Typer(
    help="Measure recall, accuracy and time on rendered or recorded frames with known truth.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)

for _command in (
    bench_detection.tilt,
    bench_detection.objects,
    bench_detection.speed,
    bench_detection.pose,
    bench_detection.negatives,
    bench_detection.recorded,
    bench_systems.grasp,
    bench_systems.live,
    bench_systems.soak,
    bench_systems.ros2,
    bench_detection.estimators,
):
    app.command()(_command)
