"""The part of `planegrasp demo` in which a simulated robot grasps: what it prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planegrasp.cli.common import pose_row
from planegrasp.cli.grasp_tables import numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from planegrasp.demo.grasping import GraspDemo, Performance, ShownGrasp

__all__ = ["WITHOUT_ROBOT", "grasps_result", "show_and_grasp"]

WITHOUT_ROBOT = (
    "[bold]Left out[/]: a simulated robot that is shown grasps and does them elsewhere. It needs"
    "\n  [green]pip install 'planegrasp\\[robot]'[/]"
)


def show_and_grasp(
    show: GraspDemo, out: Console, messages: Console, first: int
) -> tuple[Sequence[ShownGrasp], Sequence[Performance]]:
    """Show grasps, do every act, and print the story; its chapters are numbered from `first`."""
    from planegrasp.cli.progress import frame_progress
    from planegrasp.demo.grasping import STAGES

    with messages.status("learning how box and book look from the side …"):
        experiment = show.experiment()
    count = len(experiment.things) * len(show.sides)
    out.print(
        f"[bold]{first}. Show[/] a grasp once: object and gripper together, seen and recorded"
    )
    with frame_progress("showing", count, "grasps") as advance:
        shown = show.show(experiment, advance)
    _print_shown(out, shown)
    done = []
    for number, act in enumerate(show.acts, first + 1):
        out.print(f"\n[bold]{number}. Grasp[/]: {act.title[:1].lower()}{act.title[1:]}")
        with frame_progress(act.name, len(STAGES), "stages") as advance:
            done.append(show.perform(experiment, act, lambda stage: advance()))
        _print_performance(out, done[-1][0])
    with messages.status("laying out the pictures …"):
        show.write_storyboard(done)
    return shown, [performance for performance, _ in done]


def grasps_result(
    shown: Sequence[ShownGrasp], performances: Sequence[Performance]
) -> dict[str, object]:
    """The same as JSON."""
    return {
        "shown": [
            {
                "object": s.object,
                "grasp": s.grasp.name,
                "T_object_gripper": pose_row(s.grasp.T_object_gripper),
                "position_error": s.position_error,
                "rotation_error": s.rotation_error,
            }
            for s in shown
        ],
        "experiments": [_row(performance) for performance in performances],
    }


def _row(performance: Performance) -> dict[str, object]:
    trial, plan = performance.trial, performance.plan
    return {
        "name": performance.act.name,
        "object": performance.act.object,
        "tilt_deg": performance.tilt_deg,
        "true_tilt_deg": performance.true_tilt_deg,
        "inliers": trial.detection.inliers if trial.detection else None,
        "position_sigma": performance.position_sigma,
        "grasp": plan.grasp.name if plan else None,
        "T_base_gripper": pose_row(plan.T_base_gripper) if plan else None,
        "euler": plan.euler if plan else None,
        "gripper_error": trial.gripper_error,
        "reasons": trial.plan.reasons if trial.plan is not None else {},
        "success": trial.is_success,
        "cause": trial.cause,
        "slip": trial.slip,
        "lifted": trial.lifted,
        "seconds": trial.execution.seconds if trial.execution else None,
        "frames": performance.frames,
        "found": performance.found,
        "collisions": trial.collisions,
    }


def _print_shown(out: Console, shown: Sequence[ShownGrasp]) -> None:
    for name in dict.fromkeys(s.object for s in shown):
        mine = [s for s in shown if s.object == name]
        sides = ", ".join(s.grasp.name for s in mine)
        worst = 1e3 * max(s.position_error for s in mine)
        angle = math.degrees(max(s.rotation_error for s in mine))
        out.print(f"  {name:<13} {sides}: learnt to within {worst:.2f} mm, {angle:.2f}°")


def _print_performance(out: Console, performance: Performance) -> None:
    trial, plan = performance.trial, performance.plan
    for what, text in _lines(performance):
        out.print(f"  [cyan]{what:<8}[/] {text}", soft_wrap=True)
    if trial.is_success and plan is not None and trial.execution is not None:
        seen = f", seen in {performance.found} of {performance.frames} frames"
        out.print(
            f"  [green]grasped[/]  after {trial.execution.seconds:.1f} s{seen}; lifted by "
            f"{1e3 * trial.lifted:.0f} mm and held, it slipped by {1e3 * trial.slip:.1f} mm",
            soft_wrap=True,
        )
    else:
        out.print(f"  [red]failed[/]   {trial.cause or 'refused: the robot does not move'}")


def _lines(performance: Performance) -> list[tuple[str, str]]:
    """What was seen, what follows from it, and why not otherwise."""
    trial, plan, lines = performance.trial, performance.plan, []
    tilt, sigma = performance.tilt_deg, performance.position_sigma
    true = performance.true_tilt_deg
    if trial.detection is not None and tilt is not None and sigma is not None:
        lines.append(
            (
                "seen",
                f"its front tilted by {tilt:.1f}°{'' if true is None else f' (true {true:.1f}°)'}, "
                f"{trial.detection.inliers} inliers, position ± {1e3 * sigma:.1f} mm",
            )
        )
    if plan is not None:
        place = numbers(plan.T_base_gripper.translation, 3)
        lines.append(
            (
                "adapted",
                f"grasp {plan.grasp.name!r}: gripper to {place} m, roll, pitch, "
                f"yaw {numbers(map(math.degrees, plan.euler), 1)}°",
            )
        )
    if trial.gripper_error is not None:
        distance, angle = trial.gripper_error
        lines.append(("", f"off the ideal by {1e3 * distance:.2f} mm, {math.degrees(angle):.2f}°"))
    reasons = trial.plan.reasons if trial.plan is not None else {}
    lines += [("refused", f"grasp {name!r}: {reason}") for name, reason in reasons.items()]
    return lines
