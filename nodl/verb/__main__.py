"""``python -m nodl.verb`` is ``secure-nodl``."""

import sys

from enclave_common.entry import secure_nodl

sys.exit(secure_nodl())
