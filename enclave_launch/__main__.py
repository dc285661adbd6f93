"""``python -m enclave_launch`` is ``secure-launch``."""

import sys

from enclave_launch.verb.secure_launch import main

sys.exit(main())
