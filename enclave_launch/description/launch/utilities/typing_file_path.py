"""``launch.utilities.typing_file_path``."""

import os
from typing import Union

FilePath = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]"]
