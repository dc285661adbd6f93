"""API of ``launch_yaml``: YAML launch files."""

from enclave_launch.description.launch_yaml import launch_description_sources
from enclave_launch.description.launch_yaml.entity import Entity
from enclave_launch.description.launch_yaml.parser import Parser

__all__ = ["Entity", "Parser", "launch_description_sources"]
