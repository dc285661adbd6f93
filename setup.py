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
    "enclave_launch": [
        "py.typed",
        "__init__.pyi",
        "demo/lib/demo_nodes/*",
        "demo/share/*/*.xml",
        "demo/share/*/launch/*",
        "demo/share/ament_index/*/*/*",
    ],
    "nodl": ["py.typed", "schemas/*", "document/common/*/*"],
    "enclave_addons": [
        "py.typed",
        "library/documents/*",
        "library/documents/*/*",
        "recording/recorder.c",
        "review/html/assets/*",
    ],
    "keystore": ["py.typed", "__init__.pyi", "schemas/*"],
}
ENTRY_POINTS = {
    "console_scripts": [
        "secure-launch = enclave_common.entry:secure_launch",
        "secure-plan = enclave_addons.entry:secure_plan",
        "secure-keystore = enclave_common.entry:secure_keystore",
        "secure-nodl = enclave_common.entry:secure_nodl",
    ],
    "launch.frontend.launch_extension": ["enclave_launch = enclave_addons.ros2.attributes"],
    "launch_ros.node_action": [
        "security_enclaves = enclave_addons.ros2.node_action:EnclaveNodeActionExtension"
    ],
    "ros2launch.option": ["security_enclaves = enclave_addons.ros2.option:EnclaveOption"],
    "enclave_launch.describer": [
        "library = enclave_addons.library.access:LibraryAccess",
        "inference = enclave_addons.inference.describer:SourceInference",
    ],
    "enclave_launch.companion": ["recording = enclave_addons.recording.denials:explaining"],
    "keystore.planned_topics": ["launch = enclave_launch.verb.planning:planned_topics"],
    "secure_launch.mode": [
        "observation = enclave_addons.observation.mode",
        "recording = enclave_addons.recording.mode",
    ],
    "secure_keystore.verb": [
        "export = enclave_addons.deployment.keystore_verb.export",
        "import = enclave_addons.deployment.keystore_verb.import_bundle",
        "units = enclave_addons.deployment.keystore_verb.units",
        "request = enclave_addons.deployment.keystore_verb.request",
        "sign = enclave_addons.deployment.keystore_verb.sign",
        "fleet = enclave_addons.deployment.keystore_verb.fleet",
        "why = enclave_addons.deployment.keystore_verb.why",
        "zenoh = enclave_addons.zenoh.verb.zenoh",
    ],
    "secure_nodl.verb": [
        "check-record = enclave_addons.recording.verb.check_record",
        "infer = enclave_addons.inference.verb.infer",
        "library = enclave_addons.library.verb.library",
        "observe = enclave_addons.observation.verb.observe",
    ],
    "secure_plan.verb": [
        "drift = enclave_addons.observation.verb.drift",
        "export = enclave_addons.deployment.plan_verb.export",
        "hosts = enclave_addons.deployment.plan_verb.hosts",
    ],
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
            include=["enclave_common*", "enclave_launch*", "nodl*", "keystore*", "enclave_addons*"]
        ),
        package_data=PACKAGE_DATA,
        data_files=DATA_FILES,
        python_requires=">=3.10",
        install_requires=REQUIRES,
        entry_points=ENTRY_POINTS,
        zip_safe=False,
    )
