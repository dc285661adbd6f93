"""``python -m keystore.verb``: the command without its installed script."""

import sys

from keystore.verb import main

sys.exit(main())
