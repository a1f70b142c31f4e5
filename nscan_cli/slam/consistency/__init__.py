"""Maps of the same drive that have to be the same: how far a result can be trusted without any truth."""
