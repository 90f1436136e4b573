"""``python -m coneskin``."""

import sys

from .cli import main

sys.exit(main())
