"""`python -m nscan_cli` is the command `nscan-cli`."""

from nscan_cli.cli.main import main

if __name__ == "__main__":
    main()
