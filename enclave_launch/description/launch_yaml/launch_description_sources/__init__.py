"""API of ``launch_yaml.launch_description_sources``."""

from .yaml_launch_description_source import YAMLLaunchDescriptionSource

__all__ = ["YAMLLaunchDescriptionSource"]
