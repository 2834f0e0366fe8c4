"""`python -m vibrodrive` is the same as `vibrodrive`."""

from vibrodrive.cli import main

main()
