"""Build of the ROS 2 package, by colcon."""

from pathlib import Path

from setuptools import setup

NAME = "planegrasp_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *(
            (f"share/{NAME}/{part}", [str(file) for file in Path(part).iterdir() if file.is_file()])
            for part in ("launch", "config", "rviz")
        ),
    ],
    install_requires=["setuptools", "planegrasp"],
    zip_safe=True,
    maintainer="The planegrasp authors",
    maintainer_email="planegrasp@users.noreply.github.com",
    description="Finds and follows taught flat-faced objects, and publishes their poses",
    license="Apache-2.0",
    entry_points={"console_scripts": [f"live = {NAME}.live_node:main"]},
)
