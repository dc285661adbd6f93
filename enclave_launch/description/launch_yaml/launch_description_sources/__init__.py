"""API of ``launch_yaml.launch_description_sources``."""

from enclave_launch.description.launch_yaml.launch_description_sources.yaml_launch_description_source import (
    YAMLLaunchDescriptionSource,
)

__all__ = ["YAMLLaunchDescriptionSource"]
