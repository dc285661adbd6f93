"""``python -m enclave_launch`` is ``secure-launch``."""

import sys

from enclave_common.entry import secure_launch

sys.exit(secure_launch())
