"""``python -m enclave_launch.verb.secure_plan``."""

import sys

from enclave_common.entry import secure_plan

sys.exit(secure_plan())
