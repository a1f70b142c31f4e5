"""Many logs, night after night: what is out of date is mapped and measured again, and reported."""
