"""How pictures are computed, exactly and in float64: the reference with which every device is compared."""
