"""Save a library in a child process and kill it: run by test_library_kill.py, not a test itself.

    python library_kills.py FOLDER random SEED COUNT
    python library_kills.py FOLDER steps

The children are forked, so that a kill costs milliseconds and not the imports. After each kill the
library is read as a user would, and must be exactly one of the two states that are being saved.
Prints one JSON object with what happened.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import cv2
import numpy as np

from planegrasp.grasping import CanonicalGrasp
from planegrasp.library import ObjectLibrary
from planegrasp.objects import ObjectModel

# Whatever changes a file: each of these is a point to be killed at.
STEPS = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "shutil.rmtree"}
SIZES = ((0.2, 0.15, 0.1), (0.3, 0.2, 0.2))


def model(state: int) -> ObjectModel:
    """One of two boxes of one name, with other sizes, images, priority, sides and grasps."""
    rng = np.random.default_rng(state)
    images = {
        side: cv2.resize(rng.integers(0, 256, (20, 20, 3), np.uint8), (200, 150))
        for side in (("front", "back"), ("front", "back", "top"))[state]
    }
    made = ObjectModel.box("box", SIZES[state], images, priority=state)
    made.grasps.extend(grasp(name, 0.1 + 0.1 * state) for name in ("side", "top")[state:])
    return made


def grasp(name: str, opening: float) -> CanonicalGrasp:
    return CanonicalGrasp(name, np.eye(4), opening)


def fingerprint(saved: ObjectModel) -> tuple[object, ...]:
    faces = [(f.name, f.width, f.height, f.image_digest) for f in saved.faces]
    grasps = [(g.name, g.opening) for g in saved.grasps]
    return (saved.priority, saved.outer_body.size, *faces, *grasps)


def state_on_disk(folder: Path, expected: list[tuple[object, ...]]) -> int:
    """Which state the library is in, -1 for an empty one; raises for anything else."""
    library = ObjectLibrary(folder)
    if not len(library):
        return -1
    assert library.names == ("box",), library.names
    return expected.index(fingerprint(library["box"]))


def save(folder: Path, state: int, models: list[ObjectModel]) -> None:
    library = ObjectLibrary(folder)
    library.add(models[state], replace=True)
    library.save()


def run_child(work) -> int:
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os._exit(0)
    return child


def random_kills(folder: Path, seed: int, count: int) -> dict[str, object]:
    """Kill a child that saves the two states in turn, after random times.

    Times are drawn over a few saves as long as this machine takes for one, and kills go on beyond
    their number until several have hit the middle of a save and both states were met.
    """
    models = [model(0), model(1)]
    expected = [fingerprint(m) for m in models]
    rng = random.Random(seed)
    seen, interrupted = [], 0

    def work() -> None:
        for turn in range(10**6):
            save(folder, turn % 2, models)

    start = time.monotonic()
    save(folder, 1, models)
    save(folder, 0, models)
    one_save = (time.monotonic() - start) / 2
    kills = 0
    while kills < count or (kills < 10 * count and (interrupted < 5 or len(set(seen)) < 2)):
        kills += 1
        child = run_child(work)
        time.sleep(rng.uniform(0.0, 6.0) * one_save)
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        assert os.WIFSIGNALED(status), "the child ended on its own"
        interrupted += any(folder.rglob("*.tmp"))
        seen.append(state_on_disk(folder, expected))
        assert seen[-1] >= 0, "an object was lost"
    save(folder, 0, models)
    return {"kills": kills, "interrupted": interrupted, "states": sorted(set(seen)), **left(folder)}


def kills_at_every_step(folder: Path) -> dict[str, object]:
    """Kill a child before the first, second, third … change of a file, for each kind of save."""
    models = [model(0), model(1)]
    expected = [fingerprint(m) for m in models]
    steps: dict[str, int] = {}
    outcomes: dict[str, list[int]] = {}

    def remove() -> None:
        library = ObjectLibrary(folder)
        library.remove("box")
        library.save()

    def regrasp() -> None:
        library = ObjectLibrary(folder)
        library["box"].grasps[:] = [grasp("lid", 0.3)]
        library.save()

    regrasped = ObjectModel("box", models[1].faces, 1, models[1].body, [grasp("lid", 0.3)])
    expected.append(fingerprint(regrasped))
    cases = {
        "new": (lambda: None, lambda: save(folder, 0, models), {-1, 0}),
        "change": (lambda: save(folder, 0, models), lambda: save(folder, 1, models), {0, 1}),
        "grasps": (lambda: save(folder, 1, models), regrasp, {1, 2}),
        "remove": (lambda: save(folder, 1, models), remove, {1, -1}),
    }
    for name, (prepare, work, allowed) in cases.items():
        outcomes[name] = []
        for step in range(1000):
            if folder.exists():
                wipe(folder)
            prepare()
            child = run_child(lambda work=work, step=step: (kill_at(folder, step), work()))
            _, status = os.waitpid(child, 0)
            state = state_on_disk(folder, expected)
            assert state in allowed, (name, step, state)
            outcomes[name].append(state)
            if not os.WIFSIGNALED(status):
                break
        steps[name] = step
    save(folder, 0, models)
    return {"steps": steps, "outcomes": outcomes, **left(folder)}


def kill_at(folder: Path, step: int) -> None:
    """Make this process kill itself before its step-th change of a file in the folder."""
    count = 0

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal count
        if event not in STEPS or str(folder) not in str(arguments[0]):
            return
        if event == "open" and not int(arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR):
            return
        if count == step:
            os.kill(os.getpid(), signal.SIGKILL)
        count += 1

    sys.addaudithook(hook)


def wipe(folder: Path) -> None:
    for path in sorted(folder.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    folder.rmdir()


def left(folder: Path) -> dict[str, object]:
    """What is in the folder after a last, undisturbed save of state 0."""
    return {"files": sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))}


if __name__ == "__main__":
    target = Path(sys.argv[1])
    if sys.argv[2] == "random":
        print(json.dumps(random_kills(target, int(sys.argv[3]), int(sys.argv[4]))))
    else:
        print(json.dumps(kills_at_every_step(target)))
