"""``python -m fitting`` is the command ``brdf``."""

import sys

from fitting.cli import main

if __name__ == "__main__":
    sys.exit(main())
