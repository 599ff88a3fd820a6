"""How pictures are made, exactly and in float64: the reference of every device."""
