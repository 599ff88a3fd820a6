"""What pictures are made by, exactly and in float64: the reference of every device. Uses model and frames."""
