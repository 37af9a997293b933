"""`python -m raychan` is the command line."""

from raychan.cli import main

main()
