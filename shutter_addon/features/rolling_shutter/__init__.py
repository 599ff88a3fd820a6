"""Rolling shutters: find the readout of a sensor."""
