"""What a finished map tells of itself that a user should know."""
