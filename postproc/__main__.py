"""``python -m postproc``."""

from postproc.cli.app import main

main()
