"""Make the photos and the recording that docs/tutorial.md works with.

Usage: python examples/tutorial_data.py FOLDER

Everything is made from photographs that come with scikit-image, so no camera is needed:

    book.jpg        a book, seen straight on and cropped to its outline
    desk.jpg        a "phone photo" of the same book lying on the floor
    phone.json      the camera of that photo
    tea-front.png   straight photos of three sides of a box of tea, 12 × 18 × 8 cm
    tea-right.png
    tea-top.png
    poster.png      something that is nowhere in the recording
    recording/      color/, depth/, camera.json: eight RGB-D frames with the book and the box
    truth.json      where both really are in each frame
    shown.toml      where the box and a robot's gripper around it were when a grasp was shown
    now.toml        where the robot's camera is, and the box in the first frame
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np

import planegrasp as pg
from planegrasp.bench.scenes import facing_pose, rectangles
from planegrasp.bench.textures import backgrounds, texture
from planegrasp.io.camera_file import write_camera
from planegrasp.io.images import write_color, write_depth
from planegrasp.simulation import render

FRAMES = 8
BOOK_WIDTH = 0.21
TEA_SIZE = (0.12, 0.18, 0.08)
PHONE = pg.PinholeCamera(width=1600, height=1200, fx=1400.0, fy=1400.0, cx=799.5, cy=599.5)
CAMERA = pg.PinholeCamera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)

# The box stands in front of the robot and faces it; the gripper reaches from the box's right.
SHOWN = """\
T_base_object = [
    [0, 0, -1, 0.7],
    [-1, 0, 0, -0.1],
    [0, 1, 0, 0.8],
    [0, 0, 0, 1],
]
T_base_gripper = {translation = [0.7, -0.14, 0.8], quaternion = [0, 0, 0.70711, 0.70711]}
opening = 0.09
"""


def main(folder: Path) -> None:
    for sub in ("recording/color", "recording/depth"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    book = pg.ObjectModel.from_image("book", texture("coffee"), BOOK_WIDTH)
    tea = pg.ObjectModel.box("tea", TEA_SIZE, tea_photos())
    write_color(folder / "book.jpg", book.faces[0].image)
    for face in tea.faces:
        write_color(folder / f"tea-{face.name}.png", face.image)
    write_color(folder / "poster.png", texture("rocket"))
    write_desk_photo(folder, book)
    write_recording(folder, book, tea)
    write_pose_files(folder)


def tea_photos() -> dict[str, np.ndarray]:
    """Parts of photographs with the sides' aspect ratios."""
    return {
        "front": texture("astronaut")[:, 60:401],
        "right": texture("immunohistochemistry")[:450, :200],
        "top": texture("chelsea")[:280, 20:440],
    }


def write_desk_photo(folder: Path, book: pg.ObjectModel) -> None:
    """Photograph the book from half above, and say where its corners are."""
    T_camera_book = facing_pose(np.array([0.01, 0.0, 0.32]), np.radians(28), 1.9, -0.25)
    floor = cv2.GaussianBlur(backgrounds()[4], (0, 0), 1.0).astype(np.uint8)
    rng = np.random.default_rng(1)
    photo = render(rectangles(book, T_camera_book), PHONE, rng, background=floor)
    write_color(folder / "desk.jpg", photo.frame.color)
    write_camera(folder / "phone.json", PHONE)
    print_corners("desk.jpg", photo.corners[0])


def write_recording(folder: Path, book: pg.ObjectModel, tea: pg.ObjectModel) -> None:
    """Record a hand-held camera that moves past the book and the box."""
    truth = {}
    write_camera(folder / "recording/camera.json", CAMERA)
    for i in range(FRAMES):
        t = i / (FRAMES - 1)
        T_camera_book = facing_pose(
            np.array([-0.16 + 0.05 * t, 0.03, 0.62]), np.radians(15 + 45 * t), 1.2, 0.1
        )
        # Turned so that its front, its right side and its top can be seen.
        T_camera_tea = facing_pose(
            np.array([0.14 - 0.03 * t, -0.02, 0.66]), np.radians(44 - 8 * t), 0.95, 0.15
        )
        things = [*rectangles(book, T_camera_book), *rectangles(tea, T_camera_tea)]
        rng = np.random.default_rng([2, i])
        rendering = render(things, CAMERA, rng, background=backgrounds()[5])
        name = f"{i:06d}.png"
        write_color(folder / "recording/color" / name, rendering.frame.color)
        write_depth(folder / "recording/depth" / name, rendering.frame.depth)
        truth[f"{i:06d}"] = {
            "book": T_camera_book.as_matrix().tolist(),
            "tea": T_camera_tea.as_matrix().tolist(),
        }
        if i == 0:
            print_corners("recording/color/000000.png", rendering.corners[0])
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))


def write_pose_files(folder: Path) -> None:
    """A grasp that was shown, and what is known of the robot when the recording begins."""
    (folder / "shown.toml").write_text(SHOWN)
    # The camera is 1.2 m above the robot's base, and looks forward and half down.
    forward_down = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    right = np.array([0.0, -1.0, 0.0])
    T_base_camera = np.eye(4)
    T_base_camera[:3, :3] = np.column_stack([right, np.cross(forward_down, right), forward_down])
    T_base_camera[2, 3] = 1.2
    truth = json.loads((folder / "truth.json").read_text())
    poses = {"T_base_camera": T_base_camera.round(6), "T_camera_object": truth["000000"]["tea"]}
    lines = [f"{name} = {np.asarray(T).tolist()}\n" for name, T in poses.items()]
    (folder / "now.toml").write_text("".join(lines))


def print_corners(image: str, corners: np.ndarray) -> None:
    points = " ".join(f"{x:.0f},{y:.0f}" for x, y in corners)
    print(f'the book\'s corners in {image}: "{points}"')


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
