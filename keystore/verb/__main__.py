"""``python -m keystore.verb``: the command without its installed script."""

import sys

from enclave_common.entry import secure_keystore

sys.exit(secure_keystore())
