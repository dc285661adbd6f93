"""API of ``launch_xml.launch_description_sources``."""

from .xml_launch_description_source import XMLLaunchDescriptionSource

__all__ = ["XMLLaunchDescriptionSource"]
