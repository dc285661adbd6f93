"""Names of the ament index."""

from nodl.ament_index import INDEX_FOLDER as RESOURCE_INDEX_SUBFOLDER
from nodl.ament_index import PREFIX_VARIABLE as AMENT_PREFIX_PATH_ENV_VAR

__all__ = ["AMENT_PREFIX_PATH_ENV_VAR", "RESOURCE_INDEX_SUBFOLDER"]
