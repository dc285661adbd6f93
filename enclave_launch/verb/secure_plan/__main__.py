"""``python -m enclave_launch.verb.secure_plan``."""

import sys

from enclave_launch.verb.secure_plan import main

sys.exit(main())
