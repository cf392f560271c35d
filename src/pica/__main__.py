"""python -m pica: the command line."""

import sys

from pica.cli.main import main

sys.exit(main())
