"""API of ``launch_xml``: XML launch files."""

from enclave_launch.description.launch_xml import launch_description_sources
from enclave_launch.description.launch_xml.entity import Entity
from enclave_launch.description.launch_xml.parser import Parser

__all__ = ["Entity", "Parser", "launch_description_sources"]
