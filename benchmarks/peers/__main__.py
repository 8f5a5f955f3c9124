"""Print what other engines make of the shipped scenes, beside simcore."""

import sys

from benchmarks.__main__ import main

sys.exit(main(["peers", *sys.argv[1:]]))
