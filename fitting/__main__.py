"""``python -m fitting`` is the command ``brdf``."""

from fitting.cli import main

if __name__ == "__main__":
    main()
