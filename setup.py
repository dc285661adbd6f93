"""For colcon (build type ament_python); pip and everything else read pyproject.toml.

Adds what an ament index wants installed. setuptools before 61, as on Ubuntu 22.04 with ROS 2 Humble, does not read
pyproject.toml, and colcon build --symlink-install runs in a folder without it: there the same metadata is given here,
and a test holds the two together.
"""

from pathlib import Path

import setuptools

NAME = "enclave_launch"
COMMANDS = ("secure-launch", "secure-plan", "secure-keystore", "secure-nodl")
DATA_FILES = [
    ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
    (f"share/{NAME}", ["package.xml"]),
    ("share/man/man1", [f"docs/man/{command}.1" for command in COMMANDS]),
]
VERSION = "0.1.0"
REQUIRES = ["lxml>=4.8", "pyyaml>=5.4", "cryptography>=3.4.8", "asn1crypto>=1.4", "pydantic>=1.8"]
PACKAGE_DATA = {
    "enclave_common": ["py.typed"],
    "enclave_launch": ["py.typed", "__init__.pyi", "recording/recorder.c", "report/html/assets/*"],
    "nodl": ["py.typed", "schemas/*", "library/documents/*", "library/documents/*/*", "document/common/*/*"],
    "keystore": ["py.typed", "__init__.pyi", "schemas/*"],
}
ENTRY_POINTS = {
    "console_scripts": [
        "secure-launch = enclave_common.entry:secure_launch",
        "secure-plan = enclave_common.entry:secure_plan",
        "secure-keystore = enclave_common.entry:secure_keystore",
        "secure-nodl = enclave_common.entry:secure_nodl",
    ],
    "launch.frontend.launch_extension": ["enclave_launch = enclave_launch.ros2.attributes"],
    "launch_ros.node_action": [
        "security_enclaves = enclave_launch.ros2.node_action:EnclaveNodeActionExtension"
    ],
    "ros2launch.option": ["security_enclaves = enclave_launch.ros2.option:EnclaveOption"],
}

if int(setuptools.__version__.split(".")[0]) >= 61 and Path("pyproject.toml").is_file():
    distribution = setuptools.setup(data_files=DATA_FILES, license="Apache-2.0")
    # colcon reads this object's attributes as Python literals, which setuptools' SpecifierSet is not.
    for holder in (distribution, distribution.metadata):
        holder.python_requires = str(holder.python_requires)
else:
    setuptools.setup(
        name=NAME,
        version=VERSION,
        packages=setuptools.find_packages(
            include=["enclave_common*", "enclave_launch*", "nodl*", "keystore*"]
        ),
        package_data=PACKAGE_DATA,
        data_files=DATA_FILES,
        python_requires=">=3.10",
        install_requires=REQUIRES,
        entry_points=ENTRY_POINTS,
        zip_safe=False,
    )
