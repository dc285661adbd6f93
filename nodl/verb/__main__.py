"""``python -m nodl.verb`` is ``secure-nodl``."""

import sys

from nodl.verb import main

sys.exit(main())
