"""`python -m glassslam`: the command line where the program itself is not on the path."""

from glassslam.cli import main

raise SystemExit(main())
