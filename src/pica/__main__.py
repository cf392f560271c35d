"""python -m pica: the command line."""

import sys

from pica.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
