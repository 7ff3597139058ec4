"""Small arms that are not the PR2, as files that robots are read from."""

from __future__ import annotations

SIX_DOF_MJCF = """
<mujoco model="six">
  <compiler angle="radian"/>
  <default><geom type="capsule" size="0.04" mass="1"/></default>
  <worldbody>
    <body name="stand" pos="0.3 -0.2 0.5" euler="0 0 0.4">
      <geom type="box" size="0.1 0.1 0.05"/>
      <body name="link1" pos="0 0 0.1">
        <joint name="j1" axis="0 0 1" range="-2.9 2.9"/>
        <geom fromto="0 0 0 0 0 0.2"/>
        <body name="link2" pos="0 0 0.25">
          <joint name="j2" axis="0 1 0" range="-2 2"/>
          <geom fromto="0 0 0 0.4 0 0"/>
          <body name="link3" pos="0.4 0 0">
            <joint name="j3" axis="0 1 0" range="-2.5 2.5"/>
            <geom fromto="0 0 0 0.3 0 0"/>
            <body name="link4" pos="0.3 0 0">
              <joint name="j4" axis="1 0 0" range="-3 3"/>
              <geom fromto="0.02 0 0 0.06 0 0"/>
              <body name="link5" pos="0.08 0 0">
                <joint name="j5" axis="0 1 0" range="-2 2"/>
                <geom fromto="0 0 0 0.03 0 0"/>
                <body name="link6" pos="0.06 0 0">
                  <joint name="j6" axis="1 0 0" range="-3 3"/>
                  <geom fromto="0 0 0 0.03 0 0"/>
                  <site name="tool" pos="0.12 0 0" euler="0.3 0 0"/>
                  <body name="jaw" pos="0.08 0 0">
                    <joint name="jaw" type="slide" axis="0 1 0" range="0 0.06"/>
                    <geom type="box" size="0.03 0.004 0.01"/>
                  </body>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <custom><numeric name="velocity_limit:j2" data="1.5"/></custom>
</mujoco>
"""

_LINK = """
  <link name="{name}">
    <inertial><mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="{x} 0 0" rpy="0 1.5707963 0"/>
      <geometry><cylinder radius="0.04" length="{length}"/></geometry></collision>
  </link>"""
_JOINT = """
  <joint name="{name}" type="{kind}">
    <parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="50"/>
  </joint>"""


# Two fingers of 10 mm, 30 mm before and behind the tool frame's origin, 60 mm apart when open.
_FINGER = """
  <link name="{name}">
    <inertial><mass value="0.1"/>
      <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 {side}0.005 0"/>
      <geometry><box size="0.06 0.01 0.02"/></geometry></collision>
  </link>
  <joint name="{name}" type="prismatic"><parent link="tool"/><child link="{name}"/>
    <axis xyz="0 {side}1 0"/><limit lower="0" upper="0.03" velocity="0.1" effort="50"/></joint>"""


def seven_dof_urdf(*, fingers: bool = False) -> str:
    """An arm with two continuous joints and a fixed tool link, perhaps with two fingers on it."""
    links = [("base", 0.0, 0.1)]
    links += [(f"l{i}", 0.05, 0.06) for i in range(1, 8)]
    text = "".join(_LINK.format(name=name, x=x, length=length) for name, x, length in links)
    rows = [
        ("a1", "revolute", "0 0 0.3", "0 0 1", -2.8, 2.8, 2.0),
        ("a2", "revolute", "0.1 0 0.1", "0 1 0", -1.5, 1.5, 2.0),
        ("a3", "revolute", "0.2 0 0", "1 0 0", -2.8, 2.8, 2.5),
        ("a4", "revolute", "0.2 0 0", "0 1 0", -2.3, 2.3, 2.5),
        ("a5", "continuous", "0.15 0 0", "1 0 0", 0, 0, 3.0),
        ("a6", "revolute", "0.15 0 0", "0 1 0", -2.0, 2.0, 3.0),
        ("a7", "continuous", "0.1 0 0", "1 0 0", 0, 0, 3.0),
    ]
    parent = "base"
    for index, (name, kind, xyz, axis, lower, upper, velocity) in enumerate(rows, 1):
        text += _JOINT.format(
            name=name,
            kind=kind,
            parent=parent,
            child=f"l{index}",
            xyz=xyz,
            rpy="0 0 0",
            axis=axis,
            lower=lower,
            upper=upper,
            velocity=velocity,
        )
        parent = f"l{index}"
    reach = 0.2 if fingers else 0.1
    tool = f"""
  <link name="tool"/>
  <joint name="mount" type="fixed"><parent link="l7"/><child link="tool"/>
    <origin xyz="{reach} 0 0" rpy="0.2 0.3 -0.4"/></joint>"""
    if fingers:
        tool += _FINGER.format(name="left", side="") + _FINGER.format(name="right", side="-")
    return f'<robot name="seven">{text}{tool}</robot>'
