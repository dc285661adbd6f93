"""``python -m enclave_addons.review.verb``."""

import sys

from enclave_addons.entry import secure_plan

sys.exit(secure_plan())
