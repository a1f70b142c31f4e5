"""The types of relations between keyframes (paper, IV)."""
