"""Start planegrasp's node, and RViz if it is wanted."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch planegrasp_ros planegrasp.launch.py` starts."""
    share = Path(get_package_share_directory("planegrasp_ros"))
    arguments = {
        "library": ("objects", "folder of the taught objects"),
        "color_topic": ("/camera/color/image_raw", "colour image of the camera"),
        "params": (str(share / "config" / "planegrasp.yaml"), "file of all other parameters"),
        "rviz": ("false", "whether to start RViz"),
    }
    overridden = {name: LaunchConfiguration(name) for name in ("library", "color_topic")}
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in arguments.items()
            ),
            Node(
                package="planegrasp_ros",
                executable="live",
                name="planegrasp",
                output="screen",
                parameters=[LaunchConfiguration("params"), overridden],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", str(share / "rviz" / "planegrasp.rviz")],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
