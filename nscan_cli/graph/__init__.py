"""Relations → consistent poses (paper, IV)."""
