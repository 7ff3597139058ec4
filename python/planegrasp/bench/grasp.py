"""Success, refusals and failures of grasps: on a tripod and hand-held, over seeded random poses."""

from __future__ import annotations

import math
import multiprocessing
import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.reachability import Judge, Verdict
from planegrasp.bench.result import BenchResult
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import Experiment, Kind
from planegrasp.simulation.objects import cracker_box, picture_book
from planegrasp.simulation.showing import SIDES, show_grasp

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from planegrasp.simulation.trial import Trial

__all__ = ["SIDES", "GraspSettings", "Outcome", "run", "taught_experiment"]

# The walls behind the objects; the photographs on the objects are others.
_WALLS = 4


@dataclass(frozen=True, slots=True)
class GraspSettings:
    """How much is measured.

    Attributes:
        static: poses of an object on a tripod.
        handheld: poses of an object in a person's hand.
        sides: grasps that each object is taught with, each shown once, see `simulation.showing`.
        jobs: processes that share the work; each plans on one core.
    """

    static: int = 300
    handheld: int = 150
    sides: tuple[str, ...] = SIDES
    jobs: int = os.cpu_count() or 1

    @classmethod
    def quick(cls) -> GraspSettings:
        """About a minute."""
        return cls(static=8, handheld=3)

    @property
    def steps(self) -> int:
        """Number of experiments."""
        return self.static + self.handheld


@dataclass(frozen=True, slots=True)
class Outcome:
    """What is kept of one experiment.

    Attributes:
        kind: "static" or "handheld".
        seed: of its setting.
        thing: the object.
        tilt_deg: of its face against the line of sight.
        verdict: of the judge, at the true pose.
        result: "success", "refused", "failed" or "not found".
        reason: of a refusal by grasp, or the cause of a failure.
        grasp: that was chosen; "" where none was.
        gripper_mm: distance of the adapted gripper pose from the ideal one, NaN without a plan.
        gripper_deg: angle between them.
        plan_seconds: processor time of planning, NaN where nothing was planned.
        slip_mm: of the object in the gripper.
        collisions: of the robot with anything that it must not touch.
    """

    kind: Kind
    seed: int
    thing: str
    tilt_deg: float
    verdict: Verdict
    result: str
    reason: str
    grasp: str
    gripper_mm: float
    gripper_deg: float
    plan_seconds: float
    slip_mm: float
    collisions: tuple[str, ...]


def taught_experiment(sides: Sequence[str] = SIDES) -> Experiment:
    """A PR2 that was shown each grasp of each object once, in one pose.

    Raises:
        TeachingError: a side that the arm does not reach, or the camera does not see.
    """
    robot = Robot.pr2()
    things = (cracker_box(), picture_book())
    experiment = Experiment(robot, things, backgrounds=textures.backgrounds()[:_WALLS])
    for thing in things:
        for side in sides:
            shown = show_grasp(robot, thing, experiment.detector, side)
            thing.model.grasps.append(shown.grasp(side))
    return experiment


def run(seed: int, settings: GraspSettings, advance: Callable[[], None]) -> BenchResult:
    """Do all experiments, on as many processes as `settings.jobs`."""
    wanted: list[tuple[Kind, int]] = [("static", i) for i in range(settings.static)]
    wanted += [("handheld", i) for i in range(settings.handheld)]
    # The same experiments whatever their number: each has a seed of its own.
    tasks = [(kind, 1_000_000 * seed + i) for kind, i in wanted]
    outcomes = []
    for outcome in _outcomes(tasks, settings):
        outcomes.append(outcome)
        advance()
    return summary(seed, settings, outcomes)


def summary(seed: int, settings: GraspSettings, outcomes: Sequence[Outcome]) -> BenchResult:
    """The table and the figures of what came out."""
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for kind in ("static", "handheld"):
        for verdict in ("reachable", "blocked", "unreachable"):
            group = [o for o in outcomes if (o.kind, o.verdict) == (kind, verdict)]
            counts = Counter(o.result for o in group)
            rows.append(
                {
                    "object": "tripod" if kind == "static" else "hand",
                    "truth": verdict,
                    "poses": len(group),
                    "grasped": counts["success"],
                    "refused": counts["refused"],
                    "failed": counts["failed"],
                    "not found": counts["not found"],
                    "robot hit": sum(bool(o.collisions) for o in group),
                }
            )
            if verdict == "reachable":
                figures[f"{kind}.success"] = _share(counts["success"], len(group))
                figures[f"{kind}.reachable"] = float(len(group))
    unreachable = [o for o in outcomes if o.verdict == "unreachable"]
    idle = sum(o.result in ("refused", "not found") for o in unreachable)
    figures["unreachable.refused"] = _share(idle, len(unreachable))
    figures["unreachable.poses"] = float(len(unreachable))
    figures["robot_collisions"] = float(sum(bool(o.collisions) for o in outcomes))
    figures["gripper_mm_median"] = _median(o.gripper_mm for o in outcomes)
    figures["gripper_deg_median"] = _median(o.gripper_deg for o in outcomes)
    times = np.array([o.plan_seconds for o in outcomes if not math.isnan(o.plan_seconds)])
    figures["plan_seconds_median"] = _median(times)
    figures["plan_seconds_p99"] = float(np.percentile(times, 99)) if len(times) else math.nan
    figures["slip_mm_median"] = _median(o.slip_mm for o in outcomes)
    return BenchResult(
        bench="grasp",
        seed=seed,
        settings={
            "static": settings.static,
            "handheld": settings.handheld,
            "sides": list(settings.sides),
        },
        rows=rows,
        figures=figures,
        notes=(*_complaints(outcomes), *_refusals(outcomes)),
    )


def outcome_of(experiment: Experiment, kind: Kind, seed: int) -> Outcome:
    """Do one experiment and judge it."""
    setting = experiment.setting(kind, seed)
    world = experiment.world(setting)
    judge = Judge(world)
    trial = experiment.run(setting, world)
    state = experiment.robot.home if trial.state is None else trial.state
    T = setting.T_base_object if trial.T_base_object is None else trial.T_base_object
    error = trial.gripper_error or (math.nan, math.nan)
    return Outcome(
        kind=kind,
        seed=seed,
        thing=setting.thing.model.name,
        tilt_deg=math.degrees(setting.tilt),
        verdict=judge.verdict(setting.thing.model.grasps, T, state),
        result=_result(trial),
        reason=_reason(trial),
        grasp=trial.plan.grasp.name if trial.plan is not None and not trial.plan.refused else "",
        gripper_mm=1e3 * error[0],
        gripper_deg=math.degrees(error[1]),
        plan_seconds=trial.plan_seconds if trial.plan is not None else math.nan,
        slip_mm=1e3 * trial.slip if trial.is_success else math.nan,
        collisions=tuple(f"{what} at {t:.2f} s" for what, t in trial.collisions.items()),
    )


def _outcomes(tasks: Sequence[tuple[Kind, int]], settings: GraspSettings) -> Iterable[Outcome]:
    if settings.jobs <= 1:
        experiment = taught_experiment(settings.sides)
        yield from (outcome_of(experiment, kind, seed) for kind, seed in tasks)
        return
    # A fresh process has threads of its own; one that is forked does not.
    with ProcessPoolExecutor(
        settings.jobs,
        multiprocessing.get_context("spawn"),
        initializer=_begin,
        initargs=(settings.sides,),
    ) as pool:
        yield from pool.map(_do, tasks)


_worker: dict[str, Experiment] = {}


def _begin(sides: tuple[str, ...]) -> None:
    """Teach once in each process, which uses one thread."""
    os.environ["RAYON_NUM_THREADS"] = "1"
    _worker["experiment"] = taught_experiment(sides)


def _do(task: tuple[Kind, int]) -> Outcome:
    return outcome_of(_worker["experiment"], *task)


def _result(trial: Trial) -> str:
    if trial.is_success:
        return "success"
    if trial.is_refusal:
        return "refused"
    return "failed" if trial.execution is not None else "not found"


def _reason(trial: Trial) -> str:
    if trial.is_refusal and trial.plan is not None:
        return "; ".join(f"{grasp}: {why}" for grasp, why in trial.plan.reasons.items())
    return trial.cause


def _complaints(outcomes: Iterable[Outcome]) -> list[str]:
    """What went wrong where the judge says that it could be done, and every collision."""
    lines = []
    for o in outcomes:
        name = f"{o.kind} {o.seed} ({o.thing}, {o.tilt_deg:.0f}°)"
        if o.verdict == "reachable" and o.result != "success":
            lines.append(f"{name} {o.result}: {o.reason}")
        elif o.result == "failed" or (o.verdict == "unreachable" and o.result == "success"):
            lines.append(f"{name} {o.verdict}, yet {o.result}: {o.reason}")
        if o.collisions:
            lines.append(f"{name} collision: {', '.join(o.collisions)}")
    return lines


def _refusals(outcomes: Iterable[Outcome]) -> list[str]:
    """How often each kind of reason was given for a grasp."""
    kinds = Counter(
        _kind_of(reason.split(": ", 1)[-1])
        for o in outcomes
        if o.result == "refused"
        for reason in o.reason.split("; ")
    )
    counted = ", ".join(f"{why} {n}" for why, n in kinds.most_common())
    return [f"reasons of refusals, one a grasp: {counted}"] if kinds else []


def _kind_of(reason: str) -> str:
    for start in (
        "unreachable",
        "in collision",
        "no straight way",
        "it cannot be lifted",
        "no way to its pre-grasp",
        "the pose is too uncertain",
    ):
        if reason.startswith(start):
            return start
    return "other"


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan


def _median(values: Iterable[float]) -> float:
    numbers = np.array([v for v in values if not math.isnan(v)], dtype=np.float64)
    return float(np.median(numbers)) if len(numbers) else math.nan
