"""What a finished map shows about itself that a user should know."""
