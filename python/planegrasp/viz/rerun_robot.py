"""A robot that grasps, as a Rerun recording (.rrd), written without a viewer or a display.

    world                          the simulated world: z up
    world/bodies/BODY              pose of each body over time, its shapes below
    world/bodies/object/faces/…    the object's photographs
    world/camera                   the robot's camera where it was when it took a frame
    world/camera/color, outlines   the image, and the outline of what was found in it
    world/seen/cloud               the depth image as coloured points
    world/seen/object              the object's estimated pose and body
    world/plan/pregrasp, grasp     where the gripper is to go
    world/plan/path                along which way
    gripper/opening, gripper/force [m] and [N]
    object/height                  of the object's origin in the robot's base [m]
    log                            what happens, in words

The timeline is `time`, of the simulation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.closing import ClosesAtEnd
from planegrasp.simulation._dependencies import mujoco
from planegrasp.simulation.world_spec import OBJECT
from planegrasp.viz.gripper import gripper_lines
from planegrasp.viz.palette import color_of
from planegrasp.viz.rerun_parts import (
    axes,
    begun,
    closed,
    encoded_color,
    pinhole,
    point_cloud,
    pose_of,
    rerun,
    textured,
)

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.simulation.world import World

    Float64Array = NDArray[np.float64]

__all__ = ["RobotRecording"]

_FLOOR = 4.0  # what is shown of an infinite floor [m]
_AXES = 0.08  # length of the axes [m]


class RobotRecording(ClosesAtEnd):
    """Writes what a simulated robot does and sees; a context manager that closes the file.

    Raises:
        MissingExtraError: rerun-sdk is not installed.
        OSError: the file cannot be written.
    """

    def __init__(self, path: str | Path, world: World) -> None:
        """Begin a recording; `path` is replaced."""
        self._rr = rr = rerun()
        self._world = world
        self._color = color_of(world.object_model.name)
        self._stream = begun(rr, path, _blueprint())
        self._log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for geom in range(world.model.ngeom):
            self._log_shape(geom)
        for face in world.object_model.faces:
            faces = f"world/bodies/{OBJECT}/faces/{face.name}"
            self._log(faces, textured(rr, face.image), static=True)
            corners = face.object_corners + 2e-4 * face.T_object_face.rotation.as_matrix()[:, 2]
            self._log(faces, rr.Mesh3D.from_fields(vertex_positions=corners), static=True)
        for name, what in (("opening", "opening, m"), ("force", "force, N")):
            self._log(f"gripper/{name}", rr.SeriesLines(names=[what]), static=True)
        self._log("object/height", rr.SeriesLines(names=["height, m"]), static=True)

    def state(self) -> None:
        """Record where everything is now, and how the gripper holds."""
        world, rr = self._world, self._rr
        self._at(world.time)
        for body in range(1, world.model.nbody):
            w, x, y, z = world.data.xquat[body]
            pose = rr.Transform3D(
                translation=world.data.xpos[body], quaternion=rr.Quaternion(xyzw=[x, y, z, w])
            )
            self._log(f"world/bodies/{world.model.body(body).name}", pose)
        self._log("gripper/opening", rr.Scalars(world.robot.opening(world.robot_state)))
        self._log("gripper/force", rr.Scalars(world.grip().force))
        self._log("object/height", rr.Scalars(float(world.T_base_object.translation[2])))

    def frame(
        self, frame: RGBDFrame, T_world_camera: RigidTransform, found: Detection | None
    ) -> None:
        """Record a frame, of now or with its own timestamp, and what was found in it."""
        rr = self._rr
        self._at(self._world.time if frame.timestamp is None else frame.timestamp)
        self._log("world/camera", pose_of(rr, T_world_camera))
        self._log("world/camera", pinhole(rr, frame.camera))
        self._log("world/camera/color", encoded_color(rr, frame.color))
        if frame.depth is not None:
            points, colors, radius = point_cloud(frame.depth, frame.color, frame.camera)
            self._log("world/seen/cloud", pose_of(rr, T_world_camera))
            self._log("world/seen/cloud", rr.Points3D(points, colors=colors, radii=radius))
        outlines = "world/camera/outlines"
        if found is None or found.T_camera_object is None:
            for gone in (outlines, "world/seen/object"):
                self._log(gone, rr.Clear(recursive=True))
            return
        strips = [closed(frame.camera.undistort(face.corners)) for face in found.faces]
        self._log(outlines, rr.LineStrips2D(strips, colors=[self._color], radii=1.5))
        body = found.model.outer_body
        self._log("world/seen/object", pose_of(rr, T_world_camera * found.T_camera_object))
        self._log("world/seen/object/axes", axes(rr, _AXES))
        box = rr.Boxes3D(
            sizes=[body.size], centers=[body.centre], colors=[self._color], radii=0.0015
        )
        self._log("world/seen/object/body", box)

    def plan(
        self,
        time: float,
        T_world_pregrasp: RigidTransform,
        T_world_gripper: RigidTransform,
        opening: float,
        path: Float64Array,
    ) -> None:
        """Record where the gripper is to go.

        Args:
            time: at which that was decided [s].
            T_world_pregrasp: where it starts to approach.
            T_world_gripper: where it grasps.
            opening: between the fingertips [m].
            path: N×3 points of the gripper frame, in the world [m].
        """
        rr = self._rr
        self._at(time)
        for name, T in (("pregrasp", T_world_pregrasp), ("grasp", T_world_gripper)):
            self._log(f"world/plan/{name}", pose_of(rr, T))
            self._log(f"world/plan/{name}/axes", axes(rr, _AXES))
            lines = rr.LineStrips3D(gripper_lines(opening), colors=[self._color], radii=0.003)
            self._log(f"world/plan/{name}/gripper", lines)
        self._log("world/plan/path", rr.LineStrips3D([path], colors=[self._color], radii=0.002))

    def note(self, text: str) -> None:
        """Record in words what happens now."""
        self._at(self._world.time)
        self._log("log", self._rr.TextLog(text, level="INFO"))

    def close(self) -> None:
        """Write what is still buffered and close the file."""
        self._stream.flush()
        self._stream.disconnect()

    def _at(self, time: float) -> None:
        self._stream.set_time("time", duration=time)

    def _log(self, path: str, what: Any, *, static: bool = False) -> None:
        self._stream.log(path, what, static=static, strict=True)

    def _log_shape(self, geom: int) -> None:
        """The shape of a geom, once, in the frame of its body."""
        model = self._world.model
        body = model.body(model.geom_bodyid[geom]).name
        name = model.geom(geom).name or str(geom)
        shape = _shape(self._rr, model, geom)
        if shape is not None:
            self._log(f"world/bodies/{body}/{name.replace(':', '-')}", shape, static=True)


def _shape(rr: Any, model: mujoco.MjModel, geom: int) -> Any:
    """A MuJoCo geom as what Rerun calls it; None for one that it has nothing like."""
    a, b, _ = size = model.geom_size[geom]
    position = model.geom_pos[geom]
    w, x, y, z = model.geom_quat[geom]
    how = {
        "quaternions": [rr.Quaternion(xyzw=[x, y, z, w])],
        "colors": [model.geom_rgba[geom].astype(np.float32)],
        "fill_mode": "solid",
    }
    kind, shape = model.geom_type[geom], None
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        shape = rr.Boxes3D(sizes=[[_FLOOR, _FLOOR, 0.002]], centers=[position], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        shape = rr.Boxes3D(half_sizes=[size], centers=[position], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        shape = rr.Ellipsoids3D(half_sizes=[[a, a, a]], centers=[position], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        shape = rr.Ellipsoids3D(half_sizes=[size], centers=[position], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        shape = rr.Cylinders3D(radii=[a], lengths=[2 * b], centers=[position], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        # Rerun's begins at its origin, MuJoCo's has it in the middle.
        end = np.empty(3)
        mujoco.mju_rotVecQuat(end, np.array([0.0, 0.0, -b]), model.geom_quat[geom])
        shape = rr.Capsules3D(radii=[a], lengths=[2 * b], translations=[position + end], **how)
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        shape = _mesh(rr, model, geom)
    return shape


def _mesh(rr: Any, model: mujoco.MjModel, geom: int) -> Any:
    mesh = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    faces, number = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    vertices = model.mesh_vert[first : first + count] @ matrix.reshape(3, 3).T
    return rr.Mesh3D(
        vertex_positions=vertices + model.geom_pos[geom],
        triangle_indices=model.mesh_face[faces : faces + number],
        albedo_factor=model.geom_rgba[geom].astype(np.float32),
    )


def _blueprint() -> Any:
    """The scene on the left; the image, the gripper and the log on the right."""
    import rerun.blueprint as rrb

    scene = rrb.Spatial3DView(
        origin="world",
        contents=["$origin/**", "- $origin/camera/outlines/**"],
        name="Scene",
        eye_controls=rrb.EyeControls3D(
            position=(-0.6, -2.6, 1.9), look_target=(0.35, -0.1, 0.75), eye_up=(0.0, 0.0, 1.0)
        ),
    )
    image = rrb.Spatial2DView(
        origin="world/camera",
        contents=["$origin/**", "/world/plan/grasp/**", "/world/seen/object/axes"],
        name="The robot's camera",
    )
    opening = rrb.TimeSeriesView(
        origin="/", contents=["gripper/opening", "object/height"], name="Opening and height"
    )
    force = rrb.TimeSeriesView(origin="/", contents=["gripper/force"], name="Force")
    log = rrb.TextLogView(origin="log", name="Log")
    return rrb.Blueprint(
        rrb.Horizontal(
            scene,
            rrb.Vertical(image, opening, force, log, row_shares=[4, 2, 2, 2]),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline="time"),
        collapse_panels=True,
    )
