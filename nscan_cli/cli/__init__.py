"""The command line: one file a subcommand; nothing imports from here."""
